"""TRL's GRPO plays household tasks: by tools, and in plain text."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from conformance import SETTINGS, Answer, Course, differences

from er_gym import EmbodiedEnv
from er_gym.envs.actions import parse
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

pytest.importorskip("trl", reason="needs pip install 'er-gym[trl]'")
plug = pytest.importorskip("er_gym.integrations.trl")
text_plug = pytest.importorskip("er_gym.integrations.trl_text")

SEARCH = "FloorPlan319-single_search-CellPhone"
ROOM = {"episode_source": "mini", "instances": "explore"}
GOOD, BAD = ("navigate_to", {"object": "Dresser"}), ("observe", {})
END: tuple[str, dict[str, str]] = ("end", {})
"""Two first calls in the search, after which "end" earns all of its reward, and nothing."""


def a_task(task_id: str) -> Task:
    return next(task for task in load_suite("mini").tasks if task.id == task_id)


class OfTRL:
    """Calls the tool of a text's verb; TRL has no call for a text that names no action."""

    def __init__(self) -> None:
        self.room = plug.room_class(**SETTINGS)()

    def reset(self, task_id: str) -> Answer:
        (row,) = plug.rows([task for task in load_suite("er-1k").tasks if task.id == task_id])
        return Answer(self.room.reset(**row), self.room.reward, False, self.room.success)

    def step(self, text: str) -> Answer:
        action, before = parse(text), self.room.reward
        if action is None:
            told = self.room._do(text)
        else:
            tool = getattr(self.room, action.verb.replace(" ", "_"))
            told = tool(*filter(None, [action.object_type]))
        done = self.room._session._turn.done
        return Answer(told, self.room.reward - before, done, self.room.success)


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfTRL(), courses) == []


def test_what_a_model_is_told_of_the_tools() -> None:
    from transformers.utils import get_json_schema

    room = plug.room_class("mini")()
    told = get_json_schema(room.put_in)["function"]
    assert told["parameters"]["required"] == ["object"]
    assert "receptacle" in told["description"] or "hold" in told["description"]
    assert get_json_schema(room.end)["function"]["parameters"]["properties"] == {}
    room.reset(task_id=SEARCH)
    assert "names no action" in room.navigate_to("the moon")
    assert "names no action" in room.navigate_to(7)
    room.navigate_to("Dresser")
    assert room.end().startswith("Task: ")
    assert room.navigate_to("Dresser").startswith("The episode is over")
    assert plug.episode_reward([room], prompts=[]) == [2.0]
    assert plug.success([room], prompts=[]) == [1.0]
    room.reset(task_id=SEARCH)
    assert (room.reward, room.success) == (0.0, False)
    with pytest.raises(ValueError, match="unknown scaffold"):
        plug.room_class("mini", scaffold="all")


def test_pictures_where_the_template_shows_them() -> None:
    import trl.chat_template_utils as templates
    from tiny_caller import tokenizer_of

    tokenizer = tokenizer_of(["x"])
    assert not plug.shows_pictures(tokenizer)
    folder = Path(templates.__file__).parent / "chat_templates"

    def shows(name: str) -> bool:
        tokenizer.chat_template = (folder / f"{name}.jinja").read_text()
        tokenizer.image_processor = None
        return plug.shows_pictures(tokenizer)

    assert [shows(name) for name in ("qwen3_vl", "qwen3", "llava_next")] == [True, False, False]
    room = plug.room_class("mini", pictures=True, width=64, height=48)()
    for told in (room.reset(task_id=SEARCH), room.observe()):
        picture, text = told
        assert picture["image"].size == (64, 48)
        assert text["text"].startswith("Task: ")


def played(calls: list[tuple[str, dict[str, str]]]) -> tuple[list[str], float]:
    """What a room answers to calls in the search, the first observation first; the reward."""
    room = plug.room_class(**ROOM)()
    texts = [room.reset(task_id=SEARCH)]
    texts += [getattr(room, name)(**arguments) for name, arguments in calls]
    return texts, room.reward


@pytest.fixture
def one_thread() -> Iterator[None]:
    """Of torch: more only wait for each other in so small a model."""
    import torch

    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.usefixtures("one_thread")
def test_rollouts_are_played_by_tools_and_their_reward_teaches(tmp_path: Path) -> None:
    import torch
    from datasets import Dataset
    from tiny_caller import TinyCaller, called
    from trl import GRPOConfig, GRPOTrainer

    transcripts = []
    for calls in ([GOOD, END], [BAD, END]):
        (first, *answers), _ = played(calls)
        prompt = {"role": "user", "content": plug.PROMPT + first}
        transcripts.append([prompt, *called(calls, answers)])
    rooms = plug.room_class(**ROOM)
    tools = [getattr(rooms(), name) for name in sorted(vars(rooms)) if not name.startswith("_")]
    taught = TinyCaller(transcripts, tools)
    assert taught.log_likelihood().exp().min() > 0.25
    rollouts: list[tuple[list[dict[str, Any]], float]] = []

    @functools.wraps(plug.episode_reward)
    def watched(completions: Any, environments: Any, **rest: Any) -> Any:
        rewards = plug.episode_reward(environments, **rest)
        rollouts.extend(zip(completions, rewards, strict=True))
        return rewards

    steps, group = 20, 4
    trainer = GRPOTrainer(
        model=taught.model,
        processing_class=taught.tokenizer,
        args=GRPOConfig(
            output_dir=str(tmp_path),
            max_steps=steps,
            per_device_train_batch_size=group,
            num_generations=group,
            max_completion_length=128,
            max_tool_calling_iterations=4,
            learning_rate=3e-4,
            logging_steps=1,
            report_to="none",
            save_strategy="no",
            bf16=False,
            seed=0,
            disable_tqdm=True,
        ),
        train_dataset=Dataset.from_list(plug.rows([a_task(SEARCH)])),
        environment_factory=rooms,
        reward_funcs=watched,
    )
    assert [tool.__name__ for tool in trainer.tools] == [tool.__name__ for tool in tools]
    before = taught.preference()
    trainer.train()

    assert len(rollouts) == steps * group
    for messages, reward in rollouts:
        calls = [call["function"] for turn in messages for call in turn.get("tool_calls") or ()]
        answers = [turn["content"] for turn in messages if turn["role"] == "tool"]
        # What is sampled is a wrong call at times, which TRL answers with an error; and TRL leaves
        # the last unanswered when there were too many.
        done = [
            (call["name"], call["arguments"], answer)
            for call, answer in zip(calls, answers, strict=False)
            if not answer.startswith("{'error'")
        ]
        texts, earned = played([(name, arguments) for name, arguments, _ in done])
        assert ([answer for *_, answer in done], reward) == (texts[1:], earned)
    assert {reward for _, reward in rollouts} >= {0.0, 2.0}
    logs = trainer.state.log_history[:steps]
    assert all(torch.tensor([log["loss"], log["grad_norm"]]).isfinite().all() for log in logs)
    assert taught.preference() > before + 0.3


# -- plain text ------------------------------------------------------------------------------------


@pytest.mark.parametrize("dialect", ["text", "text-recall"])
def test_a_conversation_is_that_of_the_agent_with_the_same_dialect(dialect: str) -> None:
    from agents.vlm.agent import VLMAgent
    from agents.vlm.clients.scripted import ScriptedClient
    from agents.vlm.matching import Matcher
    from agents.vlm.prompts import prompts_for
    from agents.vlm.settings import AgentSettings, Prompts
    from er_gym.envs.info import with_details
    from er_gym.integrations.conversation import Conversation

    said = ["navigate to Dresser", "observe", "open Dresser", "end"]
    replies = [f"<Planning>so</Planning>\n<DecisionMaking>{each}</DecisionMaking>" for each in said]
    left = iter(replies)
    options = AgentSettings(sees="text", prompts=Prompts(dialect=dialect))
    client = ScriptedClient(lambda _: next(left))
    agent = VLMAgent(client, options, prompts_for(options), Matcher(options.matching))
    env = EmbodiedEnv(obs_mode="objects", **ROOM)
    talk = Conversation(EmbodiedEnv(obs_mode="objects", **ROOM), dialect)
    task = a_task(SEARCH)
    obs, info = env.reset(options={"task": task})
    agent.reset(task, obs, with_details(env, info))
    messages, total = talk.begin(task), 0.0
    for reply in replies:
        decision = agent.act(obs, with_details(env, info))
        heard = [(each.role, "".join(map(str, each.parts))) for each in agent.messages]
        assert heard[:-1] == [(each["role"], each["content"]) for each in messages]
        obs, reward, *_, info = env.step(decision.action)
        total += reward
        messages += [{"role": "assistant", "content": reply}, talk.answer(reply)]
    assert (talk.reward, talk.success, talk.done) == (total, info["success"], True)
    with pytest.raises(ValueError, match="shows pictures"):
        Conversation(env, "tags")


class ScriptedTrainer:
    """What a ``rollout_func`` uses of GRPOTrainer; its model writes what a script says."""

    def __init__(self, tokenizer: Any, scripts: dict[str, list[str]], longest: int) -> None:
        self.processing_class = tokenizer
        self.max_completion_length = longest
        self.accelerator = SimpleNamespace(device="cpu")
        self.generation_config = SimpleNamespace(max_new_tokens=longest)
        self.eos_token_ids = [tokenizer.eos_token_id]
        self.model_wrapped = self
        self.device = "cpu"
        self.config = None
        self._scripts = scripts
        self._said: dict[str, int] = {}

    def generate(self, input_ids: Any, attention_mask: Any, **_: Any) -> Any:
        import torch

        replies = []
        for row, mask in zip(input_ids, attention_mask, strict=True):
            read = self.processing_class.decode(row[mask.bool()])
            who = next(name for name in self._scripts if name in read)
            place = read.count("<|im_start|>assistant") - 1
            replies.append(f"{self._scripts[who][place]}<|im_end|>")
        new = [self.processing_class(each)["input_ids"] for each in replies]
        width = max(map(len, new))
        pad = self.processing_class.pad_token_id
        padded = torch.tensor([each + [pad] * (width - len(each)) for each in new])
        return torch.cat([input_ids, padded], dim=1)


def test_text_rollouts_are_conversations_of_which_the_replies_are_learnt(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import contextlib

    from transformers import AutoTokenizer

    from agents.zoo.index import find_model

    monkeypatch.setattr(
        text_plug, "unwrap_model_for_generation", lambda model, _: contextlib.nullcontext(model)
    )
    tokenizer = AutoTokenizer.from_pretrained(str(find_model("er-tiny-text").folder))
    tasks = [a_task(SEARCH), load_suite("mini").tasks[0]]
    assert text_plug.text_rows(tasks) == [{"prompt": task.id} for task in tasks]
    decided = {
        task.instruction: [f"<DecisionMaking>{each}</DecisionMaking>" for each in said]
        for task, said in zip(
            tasks, (["navigate to Dresser", "end"], ["observe", "sing", "end"]), strict=True
        )
    }
    rollouts = text_plug.TextRollouts("mini", instances="explore")
    trainer = ScriptedTrainer(tokenizer, decided, 4000)
    for _ in range(2):  # the rooms are used again
        told = rollouts([task.id for task in tasks], trainer)
        assert (told["earned"], told["won"]) == ([2.0, 0.0], [1.0, 0.0])
        assert text_plug.earned(**told) == told["earned"]
        assert text_plug.won(**told) == told["won"]
        for place, task in enumerate(tasks):
            ids, mask = told["completion_ids"][place], told["env_mask"][place]
            assert len(ids) == len(mask)
            learnt = tokenizer.decode([each for each, on in zip(ids, mask, strict=True) if on])
            said = decided[task.instruction]
            assert learnt.replace(" ", "") == "".join(f"{s}<|im_end|>" for s in said).replace(
                " ", ""
            )
            talk = rollouts._talk()
            messages = talk.begin(task)
            for text in said:
                messages += [{"role": "assistant", "content": text}, talk.answer(text)]
            whole = tokenizer.apply_chat_template(messages[:-1], tokenize=False).rstrip("\n")
            assert tokenizer.decode(told["prompt_ids"][place] + ids) == tokenizer.decode(
                tokenizer(whole)["input_ids"]
            )

    trainer.max_completion_length = 30
    cut = rollouts([tasks[1].id], trainer)
    assert len(cut["completion_ids"][0]) == len(cut["env_mask"][0]) <= 30
    assert cut["won"] == [0.0]
