"""What an error message of AI2-THOR means for an agent: a table of patterns.

The messages are those of the embedded engine and of AI2-THOR's player, for the actions that skills
call. They name objects by ids and scene names, and state positions; an agent is told types and
plain words instead. A message that no row knows means
:data:`~er_gym.envs.feedback_words.DID_NOT_WORK`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from er_gym.envs import feedback_words as words
from er_gym.envs.feedback_words import Sentence
from er_gym.thor import OBJECT_TYPES

_TOKEN = re.compile(r"[A-Za-z]+")
_WALL = re.compile(r"\b(?:wall|ceiling)", re.IGNORECASE)
_RAW = re.compile(
    r"\||_[0-9a-f]{8}\b|\d\.\d|\bAgent \d|Exception|AI2-THOR|forceAction|CanBeSliced"
    r"|\bsim ?obj|GetReachablePositions|FloorPlan|\bagent's\b",
    re.IGNORECASE,
)
"""Signs by which a message of AI2-THOR differs from the environment's own words."""


@dataclass(frozen=True)
class _Row:
    """A kind of message.

    Attributes:
        pattern: searched in the message's first line; its group ``thing`` holds an object's name.
        means: in words; ``otherwise``: where the name is of no known type; ``wall``: of a wall.
    """

    pattern: re.Pattern[str]
    means: Sentence
    otherwise: Sentence
    wall: Sentence | None = None


def _row(
    pattern: str, means: Sentence, otherwise: Sentence | None = None, wall: Sentence | None = None
) -> _Row:
    return _Row(re.compile(pattern, re.IGNORECASE), means, otherwise or means, wall)


_IN_THE_WAY = (words.BLOCKED, words.BLOCKED_SOMEHOW, words.BLOCKED_BY_WALL)
_ROWS = (
    # Moving and standing.
    _row(r"hand object collision|held (?:object|item)\b.*\b(?:collid|collision|block|obstruct)",
         words.HELD_BLOCKS),
    _row(r"^(?P<thing>.+?) is (?:blocking|obstructing)\b", *_IN_THE_WAY),
    _row(r"Cannot teleport to \([^)]*\): (?P<thing>.+?) is there", *_IN_THE_WAY),
    _row(r"collid\w+(?: with)?:? ?(?P<thing>.*)", *_IN_THE_WAY),
    _row(r"out of scene bounds|beyond every wall|teleport to height|(?:pitch or|horizon must|"
         r"max distance)|not on the floor|\bnavmesh", words.NO_ROOM),
    # Seeing and reaching.
    _row(r"is inside (?P<thing>\S+), which is closed", words.IN_CLOSED, words.NOT_SEEN),
    _row(r"within the specified visibility|not visible|occluded|not interactable|out of view|"
         r"too far", words.NOT_SEEN),
    # The hand.
    _row(r"hand holds (?P<thing>\S+) already", words.HOLDS, words.HOLDS_SOMETHING),
    _row(r"hand has something in it already|already holding", words.HOLDS_SOMETHING),
    _row(r"hand is empty|isn'?t holding|not holding|nothing in (?:the )?(?:agent'?s )?hand|"
         r"no object (?:is )?held", words.HOLDS_NOTHING),
    _row(r"in (?:the )?agent'?s (?:own )?hand", words.IN_HAND),
    # Putting.
    _row(r"^(?P<thing>\S+) is closed; open it", words.SHUT, words.SHUT_IT),
    _row(r"receptacle is closed|target is not open", words.SHUT_IT),
    _row(r"does not take an? (?P<thing>\w+)", words.NOT_TAKEN, words.NOT_TAKEN_HELD),
    _row(r"not a valid object type|cannot be placed|can'?t be placed", words.NOT_TAKEN_HELD),
    _row(r"no valid (?:position|place)s?|free space|not clear|\bis full\b|no valid points",
         words.NO_SPACE),
    _row(r"not an? (?:valid )?receptacle|no receptacle", words.NO_PLACE),
    # States.
    _row(r"switch it off before|must be off\b|turn(?:ed)? off (?:first|before)", words.RUNNING),
    _row(r"must be closed\b", words.AJAR),
    _row(r"is not toggled itself", words.BY_OTHER),
    _row(r"\bopen already|already (?:fully )?open", words.IS_OPEN),
    _row(r"\bclosed already|already (?:fully )?closed", words.IS_CLOSED),
    _row(r"\bon already|already (?:toggled |turned )?on\b", words.IS_ON),
    _row(r"\boff already|already (?:toggled |turned )?off\b", words.IS_OFF),
    _row(r"only its parts", words.IN_PARTS),
    _row(r"\balready\b", words.IS_SO),
    # Properties.
    _row(r"not (?:something that can be picked up|pickup?able)|can ?not be picked up",
         words.NO_PICKUP),
    _row(r"not (?:an? )?openable|can ?not be opened", words.NO_OPENING),
    _row(r"not (?:an? )?toggle?able|can ?not be toggled", words.NO_SWITCH),
    _row(r"(?:not|can ?not) .*slice|CanBeSliced", words.NO_SLICING),
    _row(r"clear space|clip into|obstruct|\bblock(?:ed|s|ing)\b", words.BLOCKED_SOMEHOW),
    _row(r"^No object with|not found|does not exist|appears to be invalid", words.NOT_THERE),
    _row(r"\bis not (?:an? |some)|property\b", words.UNFIT),
)  # fmt: skip
"""The rows in the order in which they are tried."""


def problem_of(message: str) -> str:
    """The problem that an error message of AI2-THOR states, in plain English."""
    first_line = message.strip().partition("\n")[0]
    for row in _ROWS:
        found = row.pattern.search(first_line)
        if found is None:
            continue
        if "thing" not in row.pattern.groupindex:
            return row.means()
        kind = type_named(found["thing"])
        if kind:
            return row.means(thing=kind)
        is_wall = row.wall is not None and _WALL.search(found["thing"])
        return row.wall() if row.wall is not None and is_wall else row.otherwise()
    return words.DID_NOT_WORK()


def type_named(name: str) -> str:
    """The object type in an object's id or scene name, ``""`` if it is of none.

    That of ``Bed_3b160ca2`` is ``Bed``, and that of ``Sink|-01.00|+00.50|+02.25|SinkBasin`` is
    ``SinkBasin``.
    """
    return next((word for word in reversed(_TOKEN.findall(name)) if word in OBJECT_TYPES), "")


def is_raw(message: str) -> bool:
    """Whether a text has signs of a message of AI2-THOR."""
    return _RAW.search(message) is not None
