"""Wordings for learning alone: none has words that evaluation keeps, and all fit their tasks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Literal

import pytest

from er_gym.tasks.suites import load_suite
from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.english_further import FURTHER
from er_gym.tasks.wordings.grammar import Grammar
from er_gym.tasks.wordings.instructions import further_instruction, wording_of
from er_gym.tasks.wordings.names import names_unseen, types_named_in
from er_gym.tasks.wordings.told import told_by

_FIELDS = {
    "find": {"object", "an_object", "it", "is", "room"},
    "pick up": {"object", "an_object", "it", "is", "room"},
    "toggle": {"object", "an_object", "it", "is", "room", "way"},
    "move": {"object", "an_object", "it", "is", "room", "place"},
}
_FIELDS["move two"] = {
    *_FIELDS["move"],
    *(f"second_{each}" for each in ("object", "an_object", "it", "place")),
}


def _texts(grammar: Grammar, part: Literal["seen", "unseen"]) -> Iterator[str]:
    yield from getattr(grammar.frames, part)
    for sentences in grammar.sentences.values():
        yield from getattr(sentences.whole, part)
        yield from getattr(sentences.cores, part)
    for style in getattr(grammar.styles, part):
        yield from (style.alone, style.first, *style.between, style.last, style.end)
    for joiner in getattr(grammar.joiners, part):
        yield from (joiner.first, *joiner.between, joiner.last)
    for ways in grammar.verbs.values():
        yield from getattr(ways, part)


def _words(texts: Iterator[str]) -> set[str]:
    return {
        word for text in texts for word in re.findall("[a-z']+", re.sub(r"{\w+}", "", text.lower()))
    }


def test_no_word_is_one_that_only_evaluation_uses() -> None:
    kept = _words(_texts(ENGLISH, "unseen")) - _words(_texts(ENGLISH, "seen"))
    assert {"errand", "store", "collect"} <= kept
    assert not kept & _words(_texts(FURTHER, "seen"))
    assert not _words(_texts(FURTHER, "unseen"))


def test_templates_have_the_fields_of_their_kind() -> None:
    assert FURTHER.sentences.keys() == _FIELDS.keys() == ENGLISH.sentences.keys()
    for kind, templates in FURTHER.templates.items():
        assert len(templates.seen) > 300
        for template in templates.seen:
            fields = set(re.findall(r"{(\w+)}", template))
            assert fields <= _FIELDS[kind], template
            assert fields & {"object", "an_object"}, template
            assert "way" in fields or kind != "toggle", template
            assert "place" in fields or not kind.startswith("move"), template
            assert fields & {"second_object", "second_an_object"} or kind != "move two", template
            assert re.fullmatch(r"[A-Z{].*[.?!]", template), template


def test_every_task_of_a_suite_can_be_told() -> None:
    """The things and places that the name has are named, by no name that evaluation keeps."""
    tasks = load_suite("mini").tasks
    told = {task.id: further_instruction(task.name, task.id, task.scene) for task in tasks}
    assert all(told.values())
    assert told == {task.id: further_instruction(task.name, task.id, task.scene) for task in tasks}
    for task in tasks:
        said = told[task.id]
        assert said is not None
        assert types_named_in(task.name) <= types_named_in(said), said
        assert not names_unseen(said)
        assert "{" not in said
        assert said[0].isupper()
    others = [told[task.id] for task in tasks if wording_of(task.name, told[task.id] or "") is None]
    assert len(others) > 0.9 * len(tasks)


@pytest.mark.parametrize("name", ["", "Dance with the Mug.", "Find the Mug"])
def test_other_names_are_not_told(name: str) -> None:
    assert told_by(name) is None
    assert further_instruction(name, "t", "FloorPlan1") is None


def test_another_draw_is_told_otherwise() -> None:
    drawn = [
        further_instruction("Pick up the Mug in the kitchen.", f"t{number}", "FloorPlan1")
        for number in range(300)
    ]
    assert len({*drawn}) > 200
    told = " ".join(filter(None, drawn))
    assert {"retrieve", "fetch", "grab"} <= {*re.findall("[a-z]+", told)}


@pytest.mark.parametrize(
    "name", ["Find the Mug in the kitchen.", "Pick up the Mug in the kitchen."]
)
def test_half_of_the_rooms_are_just_the_room(name: str) -> None:
    drawn = [further_instruction(name, f"t{number}", "FloorPlan1") for number in range(400)]
    named = [said for said in drawn if said and "the kitchen" in said]
    plain = [said for said in drawn if said and "the room" in said]
    assert 0.4 < len(plain) / len([*plain, *named]) < 0.6
    assert len({*plain}) > 60
    at_home = [
        further_instruction(name.replace("kitchen", "house"), f"t{n}", "House1-1")
        for n in range(99)
    ]
    assert "the house" in "".join(filter(None, at_home))
    assert not any(said and "the room" in said for said in at_home)
