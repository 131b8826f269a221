"""The facts of a moment in words, numbered, for a model that checks a thought against them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from agents.expert.writers.nouns import names
from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import Language, SeenObject

_START = "the place where it started"


@dataclass(frozen=True)
class Fact:
    """A fact of the record.

    Attributes:
        id: its number, ``"F1"``.
        about: what it tells of: ``task``, ``view``, ``seen``, ``hand``, ``place``, ``deeds``,
            ``decision`` or ``inside``.
        text: a sentence.
    """

    id: str
    about: str
    text: str


def facts_told(known: Knowledge) -> tuple[Fact, ...]:
    """All that the record has of a turn."""
    words = (
        *(("task", each) for each in _task(known)),
        *(("view", each) for each in _view(known)),
        *(("seen", each) for each in _seen(known)),
        ("hand", _hand(known)),
        ("place", _place(known)),
        *(("deeds", each) for each in _deeds(known)),
        ("decision", f"What the robot has decided to do next: {known.decision}."),
        (
            "inside",
            "What is inside a closed thing that the robot has not opened is not known to it.",
        ),
    )
    return tuple(Fact(f"F{k}", about, text) for k, (about, text) in enumerate(words, 1))


def named(object_type: str, language: Language) -> str:
    """A type with its everyday name: ``CoffeeMachine (coffee machine)``."""
    known = names(language).get(object_type)
    return (
        f"{object_type} ({known[0].rpartition(' ')[2] if language == 'zh' else known[0]})"
        if known
        else object_type
    )


def _task(known: Knowledge) -> Iterator[str]:
    yield f"The task, and nothing else is asked of the robot: {known.instruction}"


def _view(known: Knowledge) -> Iterator[str]:
    if known.views:
        yield "The robot has just looked around; it is told what is in view in each direction."
    for direction, things in (("ahead", known.view), *known.views.items()):
        looking = "Looking ahead" if direction == "ahead" else f"Looking to the {direction}"
        if direction == "behind":
            looking = "Looking behind"
        for each in things:
            yield f"{looking}, in view: {_thing(each, known.language)}."
    yield f"Nothing else is in view now. Numbers ahead: {_counted(known.view, known.language)}."


def _thing(each: SeenObject, language: Language) -> str:
    parts = [
        named(each.type, language),
        {"ahead": "straight ahead", "left": "on the left", "right": "on the right"}[each.side],
        f"{each.distance:.1f} m away",
        *([f"on or in the {named(each.on, language)}"] if each.on else []),
        *([] if each.open is None else ["open" if each.open else "closed"]),
        *([] if each.toggled is None else ["switched on" if each.toggled else "switched off"]),
    ]
    return ", ".join(parts)


def _counted(things: Sequence[SeenObject], language: Language) -> str:
    counts: dict[str, int] = {}
    for each in things:
        counts[each.type] = counts.get(each.type, 0) + 1
    return ", ".join(f"{number} {named(name, language)}" for name, number in counts.items()) or "0"


def _seen(known: Knowledge) -> Iterator[str]:
    gone: Mapping[str, Sequence[str]] = {
        name: places for name, places in known.sightings.items() if name not in known.in_view
    }
    for name, places in gone.items():
        where = " and ".join(
            f"when it was at the {named(each, known.language)}" if each else f"from {_START}"
            for each in places
        )
        lay = known.where(name)
        on = f", on or in the {named(lay, known.language)}" if lay else ""
        yield f"Seen before, not in view now: {named(name, known.language)}, {where}{on}."
    for name, places in known.sightings.items():
        if name in known.in_view and any(place != known.at for place in places):
            where = ", ".join(named(each, known.language) if each else _START for each in places)
            yield f"In view now and before: {named(name, known.language)}, from {where}."
    yield "No type of thing that is not named above was ever in view."


def _hand(known: Knowledge) -> str:
    if not known.held:
        return "In the robot's hand: nothing."
    return f"In the robot's hand: {named(known.held, known.language)}, and nothing else."


def _place(known: Knowledge) -> str:
    if not known.at:
        return "The robot is where it started; it has gone nowhere."
    return f"The robot went last to: {named(known.at, known.language)}."


def _deeds(known: Knowledge) -> Iterator[str]:
    for number, each in enumerate(known.actions, 1):
        came = "done" if each.success else f"failed. The answer to it: {each.feedback}"
        yield f"Action {number}: {each.action}: {came}"
    failed = sum(not each.success for each in known.actions)
    yield (
        f"The robot has done {len(known.actions)} actions, of which {failed} failed, and has done "
        "nothing else to anything."
    )
