"""Instructions of tasks in seen and unseen wordings, and which wording an instruction has."""

from __future__ import annotations

import random
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import Literal, get_args
from zlib import crc32

from er_gym.tasks.room_kinds import HOUSE, ROOM_KINDS, room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.wordings import chinese
from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.english_further import FURTHER
from er_gym.tasks.wordings.grammar import Grammar, Parts, Style, Wording, capital
from er_gym.tasks.wordings.names import as_types, chinese_names, names_unseen, renamed
from er_gym.tasks.wordings.told import IN_ORDER, Place, Thing, Told, told_by
from er_gym.tasks.wordings.words import subject_words

Language = Literal["en", "zh"]
"""A language of instructions."""
LANGUAGES: tuple[Language, ...] = get_args(Language)
_GRAMMARS: Mapping[str, Grammar] = {"en": ENGLISH, "zh": chinese.CHINESE}
_CHINESE = re.compile(r"[\u4e00-\u9fff]")
_ROOM = re.compile("|".join((*ROOM_KINDS, rf"\b{HOUSE}\b", *chinese.ROOMS.values())))
_CLAUSES = {
    kind: re.compile(pattern)
    for kind, pattern in {
        "put": r"put the (\w+) (?P<in>in|on) the (\w+)",
        "turn on": r"turn on the (\w+)",
        "turn off": r"turn off the (\w+)",
        "wash": r"wash the (\w+) in the (\w+) with water from the (\w+)",
        "fill": r"fill the (\w+) in the (\w+) with water from the (\w+)",
        "brew": r"fill the (\w+) with coffee from the (\w+)",
        "toast": r"toast the (\w+) in the (\w+)",
        "heat": r"heat the (\w+) in the (\w+), turning it on and off again",
        "cool": r"cool the (\w+) in the closed (\w+)",
        "slice": r"slice the (\w+) with the (\w+) and lay the (\w+) down (?P<in>in|on) the (\w+)",
    }.items()
}
"""The clauses of recipes in English, for :data:`er_gym.tasks.wordings.chinese.CHINESE`."""


def instruction(
    name: str,
    task_id: str,
    scene: str,
    wording: Wording = "seen",
    language: Language = "en",
) -> str | None:
    """An instruction for a task; the same for the same arguments in every process.

    Args:
        name: the task's name, which says what is to be done.
        task_id: draws one of the wordings.
        scene: its kind of room may be named.
        wording: whether the instruction may occur in training.
        language: the instruction's.

    Returns:
        None if the name is none that er-gym generates, or has a verb of another package that the
        language lacks.
    """
    told = told_by(name)
    rng = random.Random(f"{task_id}/{wording}/{language}")
    if told is None:
        return None
    told = replace(told, room=told.room or room_kind(scene))
    if (said := _drawn(told, wording, language, rng, _GRAMMARS[language])) is None:
        return None
    return said if language == "zh" else renamed(capital(said), wording, rng)


def further_instruction(name: str, draw: str, scene: str) -> str | None:
    """An English instruction for a task in a wording of :data:`FURTHER`, from which no suite draws.

    Half of those that name a room, but no house, call it just "the room".

    Args:
        name: the task's name, which says what is to be done.
        draw: draws one of the wordings; the same text always draws the same one.
        scene: its kind of room may be named.

    Returns:
        None if the name is none that er-gym generates.
    """
    if (told := told_by(name)) is None:
        return None
    rng = random.Random(f"{draw}/further")
    kind = told.room or room_kind(scene)
    # Without these a model meets "room" only in "living room", and there mostly in searches.
    told = replace(told, room=kind if kind == HOUSE else rng.choice((kind, "room")))
    said = _drawn(told, "seen", "en", rng, FURTHER)
    return None if said is None else renamed(said, "seen", rng)


def reworded(task: Task, wording: Wording, language: Language = "en") -> Task:
    """A task told in a wording.

    Raises:
        ValueError: er-gym cannot tell it; see :func:`instruction`.
    """
    said = instruction(task.name, task.id, task.scene, wording, language)
    if said is None:
        raise ValueError(
            f"task {task.id}: no instruction in {language!r} for {task.name!r}; only tasks that "
            "er-gym generated, with verbs of its own, can be told in other words"
        )
    return replace(task, instruction=said)


def half_unseen(tasks: Sequence[Task]) -> tuple[Task, ...]:
    """The tasks, half of each type told in unseen wordings: which ones follows from their ids.

    Tasks that er-gym cannot tell keep their instructions.
    """
    unseen: set[str] = set()
    for kind in {task.type for task in tasks}:
        alike = [task.id for task in tasks if task.type == kind]
        alike.sort(key=lambda task_id: (crc32(task_id.encode()), task_id))
        unseen.update(alike[: len(alike) // 2])
    return tuple(
        replace(task, instruction=said)
        if task.id in unseen and (said := instruction(task.name, task.id, task.scene, "unseen"))
        else task
        for task in tasks
    )


def in_language(tasks: Iterable[Task], language: Language) -> tuple[Task, ...]:
    """The tasks with instructions in a language, each as seen or unseen as it was.

    Raises:
        ValueError: one of them cannot be told in it.
    """
    return tuple(
        task
        if language == _language(task.instruction)
        else reworded(task, wording_of(task.name, task.instruction) or "seen", language)
        for task in tasks
    )


# -- telling --------------------------------------------------------------------------------------


def _drawn(
    told: Told, wording: Wording, language: Language, rng: random.Random, grammar: Grammar
) -> str | None:
    if told.kind == IN_ORDER:
        clauses = [_ways(clause, language) for clause in told.clauses]
        if not all(ways.seen for ways in clauses):
            return None
        style: Style = rng.choice(getattr(grammar.orders, wording))
        return style.join(
            [rng.choice(ways.seen if wording == "seen" else ways.all) for ways in clauses]
        )
    template: str = rng.choice(getattr(grammar.templates[told.kind], wording))
    if language == "en":
        return template.format_map(_english(told))
    return template.format_map(_chinese(told, wording, rng))


def _english(told: Told) -> dict[str, str]:
    words = {"room": told.room, "way": told.way}
    for prefix, thing in zip(("", "second_"), told.things, strict=False):
        where = _in_english(thing.place) if thing.place else ""
        words |= {f"{prefix}{k}": word for k, word in subject_words(thing.type, where).items()}
    for prefix, place in zip(("", "second_"), told.places, strict=False):
        words[f"{prefix}place"] = _in_english(place)
    return words


def _in_english(place: Place) -> str:
    return f"{place.preposition} the {place.type}"


def _chinese(told: Told, wording: Wording, rng: random.Random) -> dict[str, str]:
    """The words in Chinese; an unseen wording draws from all names."""
    words = {"room": chinese.ROOMS.get(told.room, told.room), "way": chinese.WAYS.get(told.way, "")}
    for prefix, thing in zip(("", "second_"), told.things, strict=False):
        words[f"{prefix}object"] = _thing_in_chinese(thing, wording, rng)
    for prefix, place in zip(("", "second_"), told.places, strict=False):
        words[f"{prefix}place"] = _in_chinese(place, wording, rng)
    return words


def _thing_in_chinese(thing: Thing, wording: Wording, rng: random.Random) -> str:
    name = _name(thing.type, wording, rng)
    return f"{_in_chinese(thing.place, wording, rng)}的{name}" if thing.place else name


def _in_chinese(place: Place, wording: Wording, rng: random.Random) -> str:
    return _name(place.type, wording, rng) + ("里" if place.preposition == "in" else "上")


def _name(kind: str, wording: Wording, rng: random.Random) -> str:
    names = chinese_names().get(kind, Parts((kind,), ()))
    return rng.choice(names.seen if wording == "seen" else names.all)


def _ways(clause: str, language: Language) -> Parts[str]:
    """The ways to say a clause; none if the language lacks its verb."""
    if language == "en":
        verb, _, rest = clause.partition(" ")
        verbs = ENGLISH.verbs.get(verb, Parts((verb,), ()))
        return Parts(
            tuple(f"{each} {rest}" for each in verbs.seen),
            tuple(f"{each} {rest}" for each in verbs.unseen),
        )
    for kind, pattern in _CLAUSES.items():
        if match := pattern.fullmatch(clause):
            return _chinese_ways(kind, match)
    return Parts((), ())


def _chinese_ways(kind: str, match: re.Match[str]) -> Parts[str]:
    names = [
        chinese_names()[each].seen[0] if each in chinese_names() else each
        for each in match.groups()
        if each not in ("in", "on")
    ]
    if "in" in match.re.groupindex:
        names[-1] += "里" if match["in"] == "in" else "上"
    ways = chinese.CHINESE.verbs[kind]
    return Parts(
        tuple(way.format(*names) for way in ways.seen),
        tuple(way.format(*names) for way in ways.unseen),
    )


# -- reading back ---------------------------------------------------------------------------------


def wording_of(name: str, instruction: str) -> Wording | None:
    """Whether a task's instruction is in a wording that training sees.

    Args:
        name: the task's name.
        instruction: in English or Chinese.

    Returns:
        ``unseen`` if any part of it is kept for evaluation, a frame, a core, or the name of a
        thing; None if it is in no wording of er-gym.
    """
    told = told_by(name)
    if told is None:
        return None
    language = _language(instruction)
    told = replace(told, room=ROOM_KINDS[0])
    folded = _ROOM.sub(ROOM_KINDS[0], as_types(instruction).casefold())
    if told.kind == IN_ORDER:
        found = _wording_in_order(told, folded, language)
    else:
        if language == "en":
            words = {key: as_types(word) for key, word in _english(told).items()}
        else:
            drawn = _chinese(told, "seen", random.Random(0))
            words = {key: as_types(word) for key, word in drawn.items()}
            words["room"] = ROOM_KINDS[0]
        types = list(dict.fromkeys(re.findall(r"<\w+>", " ".join(words.values()))))
        for number, kind in enumerate(types):
            words = {key: word.replace(kind, f"<{number}>") for key, word in words.items()}
            folded = folded.replace(kind.casefold(), f"<{number}>")
        seen, unseen = _folded(told.kind, language, tuple(words.items()))
        found = "seen" if folded in seen else "unseen" if folded in unseen else None
    return "unseen" if found and names_unseen(instruction) else found


def _language(instruction: str) -> Language:
    return "zh" if _CHINESE.search(instruction) else "en"


@lru_cache(maxsize=512)
def _folded(
    kind: str, language: Language, words: tuple[tuple[str, str], ...]
) -> tuple[frozenset[str], frozenset[str]]:
    """All wordings of a kind of task with these words, for comparison: the seen and the unseen."""
    templates, given = _GRAMMARS[language].templates[kind], dict(words)
    return (
        frozenset(each.format_map(given).casefold() for each in templates.seen),
        frozenset(each.format_map(given).casefold() for each in templates.unseen),
    )


def _wording_in_order(told: Told, folded: str, language: Language) -> Wording | None:
    held_out = False
    start = 0
    for number, clause in enumerate(told.clauses):
        ways = _ways(clause, language)
        for way in sorted(ways.all, key=len, reverse=True):
            said = as_types(way).casefold()
            if (at := folded.find(said, start)) >= 0:
                held_out |= way in ways.unseen
                folded = f"{folded[:at]}§{number}§{folded[at + len(said) :]}"
                start = at
                break
    marks = tuple(f"§{number}§" for number in range(len(told.clauses)))
    seen, unseen = _joined(language, marks)
    if folded in seen:
        return "unseen" if held_out else "seen"
    return "unseen" if folded in unseen else None


@lru_cache(maxsize=128)
def _joined(language: Language, marks: tuple[str, ...]) -> tuple[frozenset[str], frozenset[str]]:
    orders = _GRAMMARS[language].orders
    return (
        frozenset(style.join(marks).casefold() for style in orders.seen),
        frozenset(style.join(marks).casefold() for style in orders.unseen),
    )
