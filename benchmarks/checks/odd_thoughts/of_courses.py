"""Odd thoughts that the course of the episode shows: what was in view, searched, done and asked."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from benchmarks.checks.odd_thoughts.moment import Moment
from er_gym.data.claims import PARTS
from er_gym.data.mentions import all_interchangeable
from er_gym.data.phrases import MARK
from er_gym.data.reading import PHRASES, Clause, read
from er_gym.data.remembered import SEARCHING
from er_gym.data.trajectory import Language
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import is_among, same_type
from er_gym.thor import OBJECT_TYPES


def walks_on(at: Moment) -> Iterator[str]:
    """What is sought is in view, and the agent goes or looks elsewhere for it."""
    known, turn = at.known, at.turn
    there = [
        each
        for view in (known.view, *known.views.values())
        for each in view
        if same_type(each.type, known.sought)
    ]
    if not turn.train or not there or known.sought == known.held:
        return
    places = {known.sought, *(each.on for each in there)} - {""}
    places |= {part for each in places for part in PARTS.get(each, ())}
    leaves = turn.verb == verbs.NAVIGATE and all(each.on for each in there)
    leaves = leaves and turn.purpose in ("search", "approach")
    leaves = leaves and any(is_among(each, turn.navigable) for each in places)
    if turn.purpose == "look around" or (leaves and not is_among(turn.object_type, places)):
        yield f"{known.sought} is in view, on {there[0].on or '?'}; {turn.action}"


_USUAL: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"\b(?:often|usually|natural place|likely place|good place|i'd expect)\b"),
    "zh": re.compile(r"通常|一般(?!不)|常常|常见|常把|习惯|最有可能"),
}
_ONLY: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(rf"\bonly\b|\ball i see\b|\bno {MARK}|\bnothing\b|\bdidn't\b|\bruled? out\b"),
    "zh": re.compile(r"只有|没有|没看到|没找到|排除|不在"),
}


def usual_after_all(at: Moment) -> Iterator[str]:
    """A place is called usual for a thing after it was said to hold something else."""
    sought = all_interchangeable([at.known.sought]) if at.known.sought in OBJECT_TYPES else ()
    said = [
        clause
        for turn in at.known.earlier[_since(at) :]
        for thought in turn
        for clause in read(thought.text, at.language)
    ]
    for text in at.texts:
        for clause in read(text, at.language):
            if _USUAL[at.language].search(clause.text):
                others = [each for each in clause.mentions if not each.types & {*sought}]
                places = {each.text.lower() for each in others}
                if len(others) < len(clause.mentions) and any(
                    _denies(one, places, at.language) for one in said
                ):
                    yield clause.text
            said.append(clause)


def _denies(clause: Clause, places: set[str], language: Language) -> bool:
    mine = {mention.text.lower() for mention in clause.mentions}
    if clause.guessed or not mine & places:
        return False
    holders = (
        each.text.lower()
        for phrase in PHRASES[language].on
        for match in phrase.finditer(clause.text)
        for each in clause.named(match, "y")
    )
    return bool(_ONLY[language].search(clause.text)) or bool(places & {*holders})


def _since(at: Moment) -> int:
    """The first turn of the present goal."""
    turns, goal = at.trajectory.turns, at.turn.subgoal
    index = at.index
    while index and turns[index - 1].subgoal == goal:
        index -= 1
    return index


_HARD: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\bhard part was\b|\btook (?:a while|some time) to find\b|\bat last\b|\bfinally\b"
    ),
    "zh": re.compile(r"好不容易|最难的|终于|费了(?!一步)"),
}


def hard_to_find(at: Moment) -> Iterator[str]:
    """A thing is said to have been hard to find, and was in view at once."""
    thing = at.turn.held or at.known.sought
    before = at.trajectory.turns[: at.index]
    searched = any(
        turn.purpose in SEARCHING and not turn.earned and turn.subgoal.thing == thing
        for turn in before
    )
    if not searched:
        yield from at.found(_HARD)


_UNSURE: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\b(?:can't tell|not sure|don't know) (?:whether|that|if) .*work|may not be enough"
    ),
    "zh": re.compile(r"不确定|不知道刚才|一次(?:可能|也许)不够"),
}


def unsure_of_success(at: Moment) -> Iterator[str]:
    """The agent cannot tell whether something worked that has worked."""
    last = at.known.last
    if last is not None and last.success:
        yield from at.found(_UNSURE)


_BRINGS: Mapping[Language, tuple[re.Pattern[str], ...]] = {
    "en": (
        re.compile(
            rf"(?P<x>{MARK})(?: in my hand)?(?: still| that| now)* (?:belongs|has to go|should go"
            r"|goes|needs to go|should end up|has to end up) (?:back )?(?:in|on|into|onto) "
            rf"(?:the |a )?(?P<y>{MARK})"
        ),
        re.compile(
            rf"\b(?:bring|carry) (?:the )?(?P<x>{MARK}|it|them)(?: over)? to the (?P<y>{MARK})"
        ),
        re.compile(rf"(?P<y>{MARK}) is where the (?P<x>{MARK}) should"),
    ),
    "zh": (
        re.compile(rf"(?P<x>{MARK})(?:还是|最后)?(?:应该|要|得|就该|该)放[到在](?P<y>{MARK})"),
        re.compile(rf"把(?P<x>{MARK})(?:带到|送到)(?P<y>{MARK})"),
        re.compile(rf"要送去的地方是(?P<y>{MARK})"),
    ),
}  # fmt: skip


def other_destinations(at: Moment) -> Iterator[str]:
    """A thing is said to belong elsewhere than the task says."""
    keys = at.trajectory.key_actions
    puts = {key.object_type or key.object_id.split("|")[0] for key in keys if key.verb == verbs.PUT}
    basins = {"SinkBasin" for key in keys if key.object_id.endswith("SinkBasin")}
    puts |= {at.turn.subgoal.place} | basins
    wanted = all_interchangeable(each for each in puts if each in OBJECT_TYPES)
    if at.turn.purpose == "put down" or not at.turn.train:
        return
    for text in at.texts:
        for clause in read(text, at.language):
            for phrase in _BRINGS[at.language]:
                for match in phrase.finditer(clause.text):
                    if not any(each.types & wanted for each in clause.named(match, "y")):
                        yield clause.text
