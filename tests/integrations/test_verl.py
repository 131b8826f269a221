"""verl's agent loop plays household tasks."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any

import pytest
from conformance import SETTINGS, Course, reply

from er_gym.tasks.suites import load_suite

agent_loop = pytest.importorskip(
    "verl.experimental.agent_loop.agent_loop", reason="needs pip install 'er-gym[verl]'"
)
plug = pytest.importorskip("er_gym.integrations.verl")


class Config(dict):  # as OmegaConf: both attributes and get
    __getattr__ = dict.__getitem__


class Server:
    """Says the texts of a course, and keeps what it reads."""

    def __init__(self, tokenizer: Any, texts: tuple[str, ...]) -> None:
        self.left, self.read, self._tokenizer = list(texts), [], tokenizer

    async def generate(self, prompt_ids: list[int], **_: Any) -> Any:
        self.read.append(self._tokenizer.decode(prompt_ids))
        words = f"{reply(self.left.pop(0))}{self._tokenizer.eos_token}"
        ids = self._tokenizer(words, add_special_tokens=False)["input_ids"]
        return SimpleNamespace(token_ids=ids, log_probs=None, extra_fields={})


async def play(tokenizer: Any, course: Course, longest: int) -> tuple[Any, Server]:
    server = Server(tokenizer, course.texts)
    turns = SimpleNamespace(max_assistant_turns=len(course.texts))
    rollout = SimpleNamespace(prompt_length=4000, response_length=longest, multi_turn=turns)
    loop = plug.HouseholdLoop(
        SimpleNamespace(config=SimpleNamespace(actor_rollout_ref=SimpleNamespace(rollout=rollout))),
        server,
        tokenizer,
        None,
        object,
        SimpleNamespace(config=Config()),
        session=SETTINGS,
    )
    (row,) = plug.rows([each for each in load_suite("er-1k").tasks if each.id == course.task_id])
    return await loop.run({}, raw_prompt=row.pop("prompt"), **row), server


@pytest.fixture(scope="module")
def tokenizer() -> Any:
    from transformers import AutoTokenizer

    from agents.zoo.index import find_model

    return AutoTokenizer.from_pretrained(str(find_model("er-tiny-text").folder))


def test_it_answers_as_gymnasium_make(tokenizer: Any, courses: tuple[Course, ...]) -> None:
    for course in courses:
        told, server = asyncio.run(play(tokenizer, course, 20_000))
        read = course.answers[:-1]
        for number, whole in enumerate(server.read):
            users = whole.split("<|im_start|>user")[1:]
            assert len(users) == number + 1
            wanted = tokenizer.decode(tokenizer(read[number].text)["input_ids"])
            assert "".join(wanted.split()) in "".join(users[-1].split())
        assert len(server.read) == len(read)
        assert told.reward_score == sum(each.reward for each in course.answers)
        assert told.extra_fields["reward_extra_info"]["success"] == course.answers[-1].success
        assert len(told.response_ids) == len(told.response_mask)
        said = tokenizer.decode(
            [one for one, on in zip(told.response_ids, told.response_mask, strict=True) if on]
        )
        assert said.count("<DecisionMaking>") >= len(course.texts)
        assert "Task:" not in said


def test_a_response_has_the_length_that_is_allowed(
    tokenizer: Any, courses: tuple[Course, ...]
) -> None:
    course = max(courses, key=lambda each: len(each.texts))
    told, server = asyncio.run(play(tokenizer, course, 100))
    assert len(told.response_ids) == len(told.response_mask) == 100
    assert len(server.read) < len(course.texts)
