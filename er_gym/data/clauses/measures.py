"""Claims about numbers, distances, the room and the task."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from collections.abc import Set as AbstractSet

from er_gym.data.clauses.reading import Span, Verdict, clauses_of, is_told, lexicon_of, sentences_of
from er_gym.data.mentions import Mention, all_interchangeable, named_in
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.data.trajectory import SeenObject
from er_gym.thor import OBJECT_TYPES

_NEAR = 1.75
"""Metres: nothing beyond is close at hand; an arm reaches 1.5 m."""
_CLOSE = 1.2
"""Metres: nothing nearer is far away."""
_DIGITS = {
    "half a": 0.5, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7,
    "eight": 8, "ten": 10, "半": 0.5,
    "一": 1, "两": 2, "二": 2, "三": 3, "四": 4, "五": 5, "六": 6, "七": 7,
    "八": 8, "九": 9, "十": 10,
}  # fmt: skip


def judge_numbers(thought: Thought) -> Iterator[Verdict]:
    """So many things of a type are in view."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not is_told(clause) or clause.intended or clause.past:
            continue
        if lexicon.uncounted.search(clause.text):
            continue
        few = {
            place: (match, mention)
            for match in span.matches(lexicon.only)
            if (mention := span.named(match, "x")) and not _is_denied(thought, clause, match)
            for place in (match.start("x"),)
        }
        for match in lexicon.counted.finditer(clause.text):
            mention = span.named(match, "x")
            if mention is None or _is_denied(thought, clause, match):
                continue
            number = lexicon.numbers.get(match["n"], 0)
            there = sum(1 for _ in thought.things(mention.types))
            exactly = bool(lexicon.only_before.search(clause.text[: match.start()]))
            if there and number:
                least = len(_counted(thought, clause, span, mention)) if exactly else 0
                yield Verdict(span.sentence, _miscount(mention, number, there, least))
        for _, mention in few.values():
            those = _counted(thought, clause, span, mention)
            if those:
                yield Verdict(span.sentence, _miscount(mention, 1, len(those), len(those)))


def _is_denied(thought: Thought, clause: Clause, match: re.Match[str]) -> bool:
    """Whether a count is denied: what is denied after it does not matter."""
    return thought.phrases.negation.search(clause.text[: match.start()]) is not None


def _miscount(mention: Mention, number: int, most: int, least: int) -> Refusal | None:
    if number > most:
        return Refusal("count", f"Only {most} of {name_of(mention)} can be seen.")
    if number < least:
        return Refusal("count", f"{least} of {name_of(mention)} can be seen, not only {number}.")
    return None


def _in_view(thought: Thought, clause: Clause, types: AbstractSet[str]) -> list[SeenObject]:
    """The things of some types in the view ahead, on the sides that a clause tells."""
    sides = {side for side, phrase in thought.phrases.sides.items() if phrase.search(clause.text)}
    those = [each for each in thought.known.view if each.type in types]
    return [each for each in those if not sides or each.side in sides]


def _counted(
    thought: Thought, clause: Clause, span: Span, mention: Mention
) -> Sequence[SeenObject]:
    """The things of that name in the view ahead, on the side and the place that are told."""
    those = _in_view(thought, clause, all_interchangeable(mention.types))
    alone = [one for each in sorted(mention.types) if (one := _in_view(thought, clause, {each}))]
    if len(mention.types) > 1 and len(alone) > 1:
        return min(alone, key=len)
    others = all_interchangeable(
        each for other in span.mentions if other is not mention for each in other.types
    )
    return [each for each in those if each.on in others] or those


def judge_distances(thought: Thought) -> Iterator[Verdict]:
    """A thing is near or far away."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not is_told(clause) or lexicon.compared.search(clause.text):
            continue
        exact = lexicon.metres.search(clause.text)
        for phrase, far in ((lexicon.near, False), (lexicon.far, True)):
            match = phrase.search(clause.text)
            if match is None and not (far and exact):
                continue
            place = match.start() if match else exact.start() if exact else 0
            before = span.among(0, place)
            other = clause.it or span.first(place, len(span.text))
            about = before or ([other] if other else [])
            if not about:
                continue
            mention = about[-1]
            types = {each for one in about for each in one.types}
            away = [each.distance for _, each in thought.things(types)]
            if not away:
                continue
            if exact:
                number = exact["n"]
                told = _DIGITS.get(number) or _DIGITS.get(number[-1:])
                told = told if told is not None else float(number)
                wrong = all(abs(told - each) > max(1.0, each / 2) for each in away)
            elif far:
                reach = match is not None and re.search("reach|够不", match.group())
                reachable = types & {*thought.known.interactable}
                wrong = max(away) < _CLOSE and (not reach or bool(reachable))
            else:
                wrong = min(away) > _NEAR
            nearest = min(away)
            yield Verdict(
                span.sentence,
                Refusal("distance", f"{name_of(mention)} is {nearest:.1f} m away.")
                if wrong
                else None,
            )
            if exact:
                break


# -- the room --------------------------------------------------------------------------------------

_EVIDENCE = (
    ("kitchen", frozenset({"Fridge", "Microwave", "StoveBurner", "StoveKnob", "CoffeeMachine"})),
    (
        "bathroom",
        frozenset(
            {"Toilet", "Bathtub", "ShowerHead", "ShowerDoor", "ShowerCurtain", "ToiletPaperHanger"}
        ),
    ),
    ("bedroom", frozenset({"Bed"})),
)
_ROUND = 40
"""Letters around a room's name that say in which sense it is named."""


def _possible_rooms(thought: Thought) -> set[str]:
    """The kinds of room that this one may be; empty if nothing tells."""
    seen = {*thought.known.seen, *thought.known.in_view}
    found = {room for room, types in _EVIDENCE if types & seen}
    if "Sofa" in seen and not found:
        return {"living room", "bedroom"}
    return found


def judge_rooms(thought: Thought) -> Iterator[Verdict]:
    """The room is a kitchen, a bathroom, a bedroom or a living room."""
    lexicon, instruction = lexicon_of(thought), thought.known.instruction.lower()
    possible = _possible_rooms(thought)
    if not possible:
        return
    for span in sentences_of(thought):
        for room, phrase in lexicon.rooms.items() if lexicon.any_room.search(span.text) else ():
            for match in phrase.finditer(span.text):
                around = span.text[max(0, match.start() - _ROUND) : match.end() + _ROUND]
                if lexicon.room_in_general.search(around) or match.group() in instruction:
                    continue
                if span.clauses[0].asks:
                    continue
                kinds = " or ".join(sorted(possible))
                yield Verdict(
                    span.sentence,
                    None
                    if room in possible
                    else Refusal("room", f"This is a {kinds}, no {match.group()}."),
                )


# -- the task --------------------------------------------------------------------------------------

_ASKED = 60
"""Letters after "the task is to" that say what it is."""


_ENDS = re.compile(r"[.;!?。；，]|,? but\b|, (?:so|and|first)\b|但|不过")
"""Where what is asked for ends."""


def judge_tasks(thought: Thought) -> Iterator[Verdict]:
    """The task asks for something."""
    lexicon, known = lexicon_of(thought), thought.known
    own = [each for each in (known.subgoal.thing, known.subgoal.place) if each in OBJECT_TYPES]
    asked = all_interchangeable((*named_in(known.instruction), *own))
    for span in sentences_of(thought):
        for match in lexicon.task.finditer(span.text):
            before = span.text[max(0, match.start() - 12) : match.end()]
            rest = _ENDS.split(span.text[match.end() : match.end() + _ASKED])[0]
            if lexicon.undone.search(before) or lexicon.undone.search(rest):
                continue
            if any(each.asks or each.conditional for each in span.clauses):
                continue
            mention = span.first(match.end(), match.end() + len(rest))
            wrong = mention is not None and not mention.types & asked
            goal = lexicon.goes_into.search(rest)
            place = (
                span.first(match.end() + goal.start("y"), match.end() + goal.end("y"))
                if goal
                else None
            )
            wrong = wrong or (place is not None and not place.types & asked)
            chore = next(
                (
                    said.group()
                    for words, given in lexicon.chores.values()
                    if (said := words.search(rest)) and not given.search(known.instruction)
                ),
                "",
            )
            if mention is None and not chore:
                continue
            yield Verdict(
                span.sentence,
                Refusal("task", f"The task says: “{known.instruction}”; do not say otherwise.")
                if wrong or chore
                else None,
            )
