"""A model as the writer of thoughts: what it is told, and what is taken of its replies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from random import Random

import pytest

from agents.expert.model_places import ModelPlaces, named_places
from agents.expert.writers.base import ThoughtRequest, WrittenThoughts
from agents.expert.writers.grammar import Table, grammar
from agents.expert.writers.grounded import GroundedWriter
from agents.expert.writers.model import ModelWriter
from agents.expert.writers.prompts import load_writer_prompts
from agents.expert.writers.registry import checked_grounded
from agents.vlm.chat import Message, ModelError, Picture, Reply, Usage
from agents.vlm.clients.scripted import ScriptedClient
from agents.vlm.settings import AgentSettings
from benchmarks.checks.scripted_expert import SAYS, good, in_tags
from benchmarks.harness import played_turns
from er_gym.data.critic import check
from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.trajectory import Language, ThoughtKind
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory

Say = Callable[[Sequence[dict[str, str]]], str]
PICTURE = Picture(b"\xff\xd8 jpeg", "image/jpeg", 160, 96)


@cache
def episode() -> tuple[str, list[object]]:
    """A real episode: two wrong places, a failure, a look around, then the solver."""
    return next(iter(played_turns.play((5,))))


def known(index: int, language: Language = "en") -> Knowledge:
    instruction, turns = episode()
    return knowledge_at(turns, index, instruction=instruction, language=language)  # type: ignore[arg-type]


def request(
    index: int = 0,
    kinds: tuple[ThoughtKind, ...] = ("reasoning", "planning"),
    pictures: tuple[Picture, ...] = (PICTURE,),
) -> ThoughtRequest:
    return ThoughtRequest(known(index), kinds, (100,) * len(kinds), pictures, seed=7)


class Asked:
    """A client that answers with a function of the conversation, and keeps what it was asked."""

    def __init__(self, *says: Say | Exception) -> None:
        self.conversations: list[list[Message]] = []
        self._says = list(says)

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        self.conversations.append(list(messages))
        say = self._says[min(len(self.conversations), len(self._says)) - 1]
        if isinstance(say, Exception):
            raise say
        return Reply(say(over_the_wire(messages)), usage=Usage(100, 10), cost=0.01, model="m")

    def close(self) -> None:
        """Do nothing."""


def over_the_wire(messages: Sequence[Message]) -> list[dict[str, str]]:
    return [
        {"role": each.role, "content": "\n".join(p for p in each.parts if isinstance(p, str))}
        for each in messages
    ]


def writer(client: Asked, **settings: object) -> ModelWriter:
    return ModelWriter(
        "openai:m", client, AgentSettings.model_validate(settings), load_writer_prompts("en")
    )


def write(*says: Say | Exception, asked: ThoughtRequest) -> tuple[WrittenThoughts, Asked]:
    client = Asked(*says)
    return writer(client).write(asked), client


def test_one_request_brings_all_thoughts_of_a_turn() -> None:
    written, client = write(good, asked=request())
    assert len(client.conversations) == 1
    assert [each.kind for each in written.thoughts] == ["reasoning", "planning"]
    assert {each.writer for each in written.thoughts} == {"openai:m"}
    assert not any(each.refused for each in written.thoughts)
    assert [(each.prompt_tokens, each.cost) for each in written.replies] == [(100, 0.01)]


def test_what_is_refused_is_asked_for_again_with_the_reasons_and_nothing_else() -> None:
    def half(messages: Sequence[dict[str, str]]) -> str:
        said = good(messages)
        return said.replace("<Planning>", "<Planning>According to the hint, ")

    written, client = write(half, good, asked=request())
    again = client.conversations[1]
    assert [each.role for each in again] == ["system", "user", "assistant", "user"]
    told = str(again[-1].parts[0])
    assert "<Planning>" in told
    assert "<Thinking>" not in told
    assert "according to the hint" in told.lower() or "Leave out" in told
    first, second = written.thoughts
    assert (first.writer, first.refused) == ("openai:m", [])
    assert (second.writer, second.refused) == ("openai:m", ["leak"])
    assert len(written.replies) == 2


@pytest.mark.parametrize("name", [name for name in SAYS if name != "tags twice"])
def test_what_is_no_thought_never_becomes_one(name: str) -> None:
    written, client = write(SAYS[name], asked=request())
    assert len(client.conversations) == 3
    grounded = checked_grounded().write(request()).thoughts
    for thought, expected in zip(written.thoughts, grounded, strict=True):
        if thought.writer == "openai:m":  # a lie may spare the other thought of the turn
            assert check(thought.text, thought.kind, known(0), limit=100) == ()
        else:
            assert thought.text == expected.text
            assert len(thought.refused) >= 3
    assert "grounded" in {each.writer for each in written.thoughts}
    assert len(written.replies) == 3


def test_without_a_reply_the_grounded_writer_writes() -> None:
    written, client = write(ModelError("500, something broke"), asked=request())
    assert len(client.conversations) == 1
    assert {each.writer for each in written.thoughts} == {"grounded"}
    assert {tuple(each.refused) for each in written.thoughts} == {("no reply",)}
    assert written.replies == ()


def test_two_thoughts_of_a_turn_may_not_be_the_same() -> None:
    def same(messages: Sequence[dict[str, str]]) -> str:
        words = "I wonder where I should look first in this room."
        return f"<Thinking>{words}</Thinking><Planning>{words}</Planning>"

    written, _ = write(same, asked=request())
    assert [each.writer for each in written.thoughts] == ["openai:m", "grounded"]
    assert set(written.thoughts[1].refused) == {"repeat"}


ECHOES = {
    "echo": "I know where the robot stands in its task, and what follows from that; at most.",
    "voice": "The robot wonders where it should look first.",
}


@pytest.mark.parametrize("code", ECHOES)
def test_a_model_that_repeats_its_prompt_is_refused(code: str) -> None:
    written, _ = write(in_tags(ECHOES[code]), asked=request())
    assert {each.writer for each in written.thoughts} == {"grounded"}
    assert all(code in each.refused for each in written.thoughts)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_what_the_grounded_writer_says_is_no_echo_of_the_prompts(language: Language) -> None:
    echo_check = load_writer_prompts(language).echo_check
    for index in range(len(episode()[1])):
        asked = ThoughtRequest(known(index, language), ("reflection", "planning"), (150, 150))
        for thought in GroundedWriter().write(asked).thoughts:
            assert echo_check.refusals(thought.text) == ()


def test_a_reply_of_two_megabytes_is_read_at_once_and_not_quoted() -> None:
    long = "x" * 2_000_000

    def huge(messages: Sequence[dict[str, str]]) -> str:
        return f"<Thinking>{long}</Thinking>" + "<Planning>" * 100_000

    written, client = write(huge, asked=request())
    assert {each.writer for each in written.thoughts} == {"grounded"}
    assert written.thoughts[0].refused == ["length"] * 3
    sent = sum(len(str(part)) for each in client.conversations[-1] for part in each.parts)
    assert sent < 100_000


def test_the_model_is_shown_the_picture_and_told_the_course_but_not_what_is_hidden() -> None:
    _, turns = episode()
    _, client = write(good, asked=request(4))
    system, user = client.conversations[0]
    assert user.parts.count(PICTURE) == 1
    told = "\n".join(part for part in user.parts if isinstance(part, str))
    instruction, _ = episode()
    assert instruction in told
    assert f"The robot's decision: {known(4).decision}" in told
    for number, action in enumerate(known(4).actions, 1):
        assert f"{number}. " in told
        assert f"-> {action.action}: " in told
    assert known(4).actions[2].feedback in told  # the failed action
    hidden = {kind for turn in turns for kind in (each.type for each in turn.view)}  # type: ignore[attr-defined]
    shown = {each.type for each in known(4).view} | set(known(4).seen)
    assert hidden - shown  # what comes into view later is not told
    assert "hint" not in str(system.parts[0])


def test_after_looking_around_every_picture_has_its_direction() -> None:
    _, turns = episode()
    index = next(i for i, turn in enumerate(turns) if turn.views)  # type: ignore[attr-defined]
    asked = request(index, pictures=(PICTURE,) * len(known(index).views))
    _, client = write(good, asked=asked)
    texts = [part for part in client.conversations[0][1].parts if isinstance(part, str)]
    assert [text.rstrip().rpartition("\n")[2] for text in texts[:3]] == [
        "What the robot sees to the right:",
        "What the robot sees behind:",
        "What the robot sees to the left:",
    ]


def test_a_model_that_does_not_see_is_sent_no_pictures() -> None:
    client = Asked(good)
    writer(client, sees="text").write(request())
    assert all(isinstance(part, str) for part in client.conversations[0][1].parts)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_every_turn_can_be_put_into_words(language: Language) -> None:
    instruction, turns = episode()
    prompts = load_writer_prompts(language)
    for index in range(len(turns)):
        knowledge = known(index, language)
        asked = ThoughtRequest(knowledge, ("reflection",), (150,))
        told = str(prompts.turn(asked, ()).parts[0])
        assert instruction in told
        assert str(knowledge.decision) in told
        assert ("。" in told) is (language == "zh")


@pytest.mark.parametrize("language", ["en", "zh"])
def test_the_prompts_have_words_for_every_outcome(language: Language) -> None:
    happened = grammar(language)["happened"]
    assert isinstance(happened, Table)
    folder = config_directory("prompts") / "expert" / language
    told = (folder / "outcome.jinja").read_text(encoding="utf-8")
    assert {row for row in happened.rows if f'"{row}": ' not in told} == {"else"}


def test_settings_for_decisions_are_refused() -> None:
    with pytest.raises(ValueError, match="leave decide out"):
        writer(Asked(good), decide="tools")


def test_the_plan_as_a_hint_names_the_key_actions() -> None:
    from er_gym.tasks import load_suite

    task = load_suite("mini").tasks[0]
    told = load_writer_prompts("en").told_plan(task)
    assert told.startswith(task.instruction)
    assert all(f"{key.verb} {key.actual_type}".strip() in told for key in task.key_actions)
    assert verbs.END in told


PLACES = ["Fridge", "CounterTop", "GarbageCan", "Sink"]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("[Fridge, Sink]", ["Fridge", "Sink"]),
        ("I would say: ['counter top', \"garbage_can\"].", ["CounterTop", "GarbageCan"]),
        ("[Narnia, Sink, sink, Fridge]", ["Sink", "Fridge"]),
        ("Fridge and Sink", []),
        ("", []),
        ("[" * 50_000, []),
    ],
)
def test_places_are_read_from_a_list_and_must_be_candidates(text: str, expected: list[str]) -> None:
    assert named_places(text, PLACES) == expected


def test_places_that_the_model_does_not_name_are_drawn() -> None:
    weighted = [(place, 1.0) for place in PLACES]
    for say, first in (("[Narnia, Sink]", ["Sink"]), ("no", [])):
        client = ScriptedClient(lambda messages, say=say: say)  # type: ignore[misc]
        places = ModelPlaces(client, load_writer_prompts("en"), seed=1)
        chosen = places.choose("Mug", weighted, 3, Random(0))
        assert chosen[: len(first)] == first
        assert len(set(chosen)) == 3
        assert set(chosen) <= set(PLACES)
        assert len(places.take_replies()) == 1
        assert len(places.take_replies()) == 0
    asked = Asked(ModelError("500"))
    places = ModelPlaces(asked, load_writer_prompts("en"), seed=1)
    assert len(places.choose("Mug", weighted, 2, Random(0))) == 2
    assert places.choose("Mug", weighted, 0, Random(0)) == []
    assert len(asked.conversations) == 1  # nothing is asked where nothing is wanted
