"""Checks that nobody guesses at what had been seen: an agent goes back there instead.

An agent that has seen the mug on the desk does not search other places for it, and does not say
that it may be in a drawer.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.mentions import all_interchangeable
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought
from er_gym.data.trajectory import Language, Purpose, Trajectory
from er_gym.thor import OBJECT_TYPES

SEARCHING: frozenset[Purpose] = frozenset({"search", "look around"})
"""Purposes of who does not know where a thing is."""
_OTHERWISE = SEARCHING | {"check", "finish"}
"""Purposes whose thoughts may guess: of a mistake on purpose, or of who has done the task."""
_OWN = ("model", "played")
"""Kinds of trajectories whose agent decided by its own mind; its course is taken as it is."""


def searches_for_the_seen(trajectory: Trajectory) -> Iterator[str]:
    """The learnt turns that search for something that is or was in view, one line for each."""
    if trajectory.kind in _OWN:
        return
    for index, turn in enumerate(trajectory.turns):
        if turn.train and turn.purpose in SEARCHING:
            known = knowledge_at(
                trajectory.turns,
                index,
                instruction=trajectory.instruction,
                language=trajectory.language,
            )
            if _remembers(known):
                yield f"turn {index}: {turn.action} to search for {known.sought}, seen before"


def check_remembered(thought: Thought) -> Iterator[Refusal]:
    """Says where a thing may be, or is usually, that is or was in view."""
    known = thought.known
    if known.purpose in _OTHERWISE or not _remembers(known):
        return
    if any(_RECALLS[known.language].search(each.text) for each in thought.clauses):
        return  # it says so itself
    names = all_interchangeable([known.sought])
    whole = " ".join(each.text for each in thought.clauses)
    for clause in thought.clauses:
        about = any(each.types & names for each in clause.mentions)
        if about and _guesses(clause, known.language) and not HEARD[known.language].search(whole):
            where = known.where(known.sought)
            yield Refusal(
                "remembered",
                f"{known.sought} was seen before{f', on or in {where}' if where else ''}: do not "
                "guess where it is.",
            )


def _remembers(known: Knowledge) -> bool:
    return known.sought in OBJECT_TYPES and known.remembers(known.sought)


def _guesses(clause: Clause, language: Language) -> bool:
    if BELIEVED[language].search(clause.text):
        return False
    if _SOMETHING_ELSE[language].search(clause.text):
        return False
    place = len(clause.mentions) > 1 or _PLACE[language].search(clause.text)
    return bool(place and _MAY_BE[language].search(clause.text))


_RECALLS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\bi(?:'ve| have|'d| had|'m sure i| do| did)?(?: (?:already|just|also|first|clearly))* "
        r"(?:saw|seen|noticed|spotted|remember|recall|caught sight of|glimpsed)\b"
        r"(?! (?:no|nothing)\b)"
    ),
    "zh": re.compile(
        r"(?<!没)(?<!没有)(?<!未)(?<!能)(?:见过|看见过|看到过|瞥见|瞧见过|记得|看到的|看见的|见到的|看到了|看见了)"
    ),
}
"""Words of one who remembers."""
HEARD: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"\b(?:they say|supposedly|reportedly|allegedly|i was told)\b"),
    "zh": re.compile(r"据说|听说|据称|说是"),
}
"""Words of one who repeats what others say."""
BELIEVED: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\bi(?:'d| had)? (?:thought|expected|assumed|figured|hoped|imagined|believed)\b"
    ),
    "zh": re.compile(r"原以为|本以为|还以为|以为"),
}
"""A belief that has been given up: "I thought that it would be there"."""
_MAY_BE: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\b(?:(?:may|might|could|must)(?: well| still| also| just)* "
        r"(?:be|have|hold|lie|hide|turn up)|perhaps|maybe|possibly|probably"
        r"|would (?:often|usually|be)|i'd expect|expect(?:ed)?|hop(?:ed?|ing)|likely|usually|often"
        r"|people|natural|good place|good guess|don't know where|wonder)\b"
    ),
    "zh": re.compile(
        r"可能|也许|或许|说不定|大概|应该在|不知道|哪里|通常|一般|常|习惯|以为|不能排除|看不出来"
    ),
}
"""Words for where a thing may be, was thought to be, or is usually."""
_PLACE: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\b(?:where|anywhere|somewhere|there|inside|behind|beside|away|among|here|overlooked"
        r"|missed)\b"
    ),
    "zh": re.compile(r"哪里|任何地方|里面|身后|旁边|其中|那里|这里|看不到|漏看|扔|丢|落在"),
}
"""Words for a place that has no name."""
_SOMETHING_ELSE: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\breach\b|\bbecause\b|\b(?:as soon as|once) i\b|\bi was asked\b|\bit should be\b"
        r"|\b(?:needn't|need not|no need|another|others?|second|spare|extra)\b"
    ),
    "zh": re.compile(r"够|拿到|拿在手|任务|不用|不必|不需要|没必要|别的|另外|另一|其他|其它|第二"),
}
"""Words for something else than where the thing is."""
