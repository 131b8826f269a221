"""What the agent perceives: small builders, each with its own Gymnasium space.

``state`` and ``text`` say nothing that an agent could not know from what it has seen, been told and
done.
"""

from __future__ import annotations

import re
import string
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import cos, radians, sin
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from er_gym.envs.legality import Surroundings
from er_gym.tasks.task import AgentPose
from er_gym.thor import OBJECT_TYPES

TYPES = tuple(OBJECT_TYPES)
_COLUMN = {name: k for k, name in enumerate(TYPES)}
_PER_TYPE = ("visible", "seen", "navigable", "interactable", "open", "on", "held", "at", "goal")
_POSE = ("right", "ahead", "sin", "cos", "horizon", "standing")
_EPISODE = ("steps", "success", "holding")
GOAL_VERBS: Mapping[str, str] = {
    "search": r"find|search|look|locate|where",
    "pickup": r"pick|take|grab|get|fetch|bring",
    "put": r"put|place|set|move|store|leave",
    "toggle": r"toggle|turn|switch|flip",
    "open": r"open",
    "close": r"close|shut",
    "then": r"then|after|before|first",
}
"""Words of an instruction that say what to do, by what they say."""
STATE_LAYOUT = (*_POSE, *_EPISODE, *GOAL_VERBS, *(f"{f}:{t}" for f in _PER_TYPE for t in TYPES))
"""What each entry of the ``state`` vector means, in order."""
_ROOM_SCALE = 10.0
"""Offsets from the start are divided by so many metres."""
_TEXT_LENGTH = 20_000


@dataclass
class Memory:
    """What an agent that pays attention remembers of an episode, by object type."""

    start: AgentPose
    seen: set[str] = field(default_factory=set)
    is_open: dict[str, bool] = field(default_factory=dict)
    is_on: dict[str, bool] = field(default_factory=dict)

    def look(self, around: Surroundings) -> None:
        """Take in what is visible now."""
        opened: dict[str, bool] = {}
        switched: dict[str, bool] = {}
        for entry in around.objects.values():
            if entry["visible"]:
                kind = entry["objectType"]
                self.seen.add(kind)
                opened[kind] = opened.get(kind, False) or entry["isOpen"]
                switched[kind] = switched.get(kind, False) or entry["isToggled"]
        self.is_open.update(opened)
        self.is_on.update(switched)


@dataclass(frozen=True)
class Situation:
    """Everything that observations are made from."""

    event: Any
    around: Surroundings
    memory: Memory
    known: frozenset[str]
    instruction: str
    feedback: str
    at: str
    success: bool
    steps: int
    max_steps: int


@lru_cache(maxsize=4096)
def goal(instruction: str) -> tuple[tuple[float, ...], tuple[tuple[str, float], ...]]:
    """What an instruction asks for, read from its words alone.

    Returns:
        A 0 or 1 for each of :data:`GOAL_VERBS`; and the object types that it names with a weight
        each, 1 for the first named, then 1/2, 1/3 and so on. ``credit card`` names a CreditCard;
        a type whose name is part of a longer one that is named there is not meant.
    """
    mentions = []
    taken = np.zeros(len(instruction) + 1, dtype=bool)
    for name in sorted(TYPES, key=len, reverse=True):
        words = r"[\s-]?".join(re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|\d+", name))
        for match in re.finditer(rf"\b{words}(?:s|es)?\b", instruction, re.IGNORECASE):
            span = slice(*match.span())
            if not taken[span].any():
                taken[span] = True
                mentions.append((match.start(), name))
    order = list(dict.fromkeys(name for _, name in sorted(mentions)))
    asked = tuple(
        float(bool(re.search(rf"\b(?:{words})", instruction, re.IGNORECASE)))
        for words in GOAL_VERBS.values()
    )
    return asked, tuple((name, 1.0 / (rank + 1)) for rank, name in enumerate(order))


def _relative_pose(situation: Situation) -> tuple[float, ...]:
    """The agent's pose in the frame of where it began."""
    agent = situation.event.metadata["agent"]
    start = situation.memory.start
    dx = agent["position"]["x"] - start.x
    dz = agent["position"]["z"] - start.z
    heading = radians(start.rotation)
    turned = radians(agent["rotation"]["y"]) - heading
    right = dx * cos(heading) - dz * sin(heading)
    ahead = dx * sin(heading) + dz * cos(heading)
    return (
        right / _ROOM_SCALE,
        ahead / _ROOM_SCALE,
        sin(turned),
        cos(turned),
        agent["cameraHorizon"] / 90.0,
        float(agent["isStanding"]),
    )


def _state(situation: Situation) -> NDArray[np.float32]:
    around, memory = situation.around, situation.memory
    asked, named = goal(situation.instruction)
    table = np.zeros((len(_PER_TYPE), len(TYPES)), dtype=np.float32)
    visible = {e["objectType"] for e in around.objects.values() if e["visible"]}
    holding = around.types([around.holding] if around.holding else [])
    marked: tuple[tuple[str, Any], ...] = (
        ("visible", visible),
        ("seen", memory.seen),
        ("navigable", situation.known),
        ("interactable", around.types(around.interactable)),
        ("open", (name for name, yes in memory.is_open.items() if yes)),
        ("on", (name for name, yes in memory.is_on.items() if yes)),
        ("held", holding),
        ("at", [situation.at] if situation.at else []),
    )
    for feature, names in marked:
        for name in names:
            table[_PER_TYPE.index(feature), _COLUMN[name]] = 1.0
    for name, weight in named:
        table[_PER_TYPE.index("goal"), _COLUMN[name]] = weight
    scalars = (
        *_relative_pose(situation),
        situation.steps / situation.max_steps,
        float(situation.success),
        float(bool(holding)),
        *asked,
    )
    vector = np.concatenate([np.array(scalars, dtype=np.float32), table.ravel()])
    return np.asarray(np.clip(vector, -1.0, 1.0))


_CHARACTERS = string.ascii_letters + string.digits + string.punctuation + " \n"
_LOOKALIKES = str.maketrans(
    {"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."}
)


def _plain(text: str) -> str:
    """Text in the characters that the text space has; others become question marks."""
    known = set(_CHARACTERS)
    return "".join(c if c in known else "?" for c in text.translate(_LOOKALIKES))[:_TEXT_LENGTH]


def _text(situation: Situation) -> str:
    around = situation.around
    visible = sorted({e["objectType"] for e in around.objects.values() if e["visible"]})
    held = "".join(around.types([around.holding])) if around.holding else "nothing"
    lines = (
        f"Task: {situation.instruction}",
        f"Step {situation.steps} of {situation.max_steps}. {situation.feedback}",
        f"You see: {', '.join(visible) or 'nothing'}.",
        f"You hold: {held}.",
        f"You can navigate to: {', '.join(sorted(situation.known)) or 'nothing'}.",
        f"Within reach: {', '.join(sorted(around.types(around.interactable))) or 'nothing'}.",
    )
    return _plain("\n".join(lines))


@dataclass(frozen=True)
class Observation:
    """A kind of observation: its space, given the frame's width and height, and how it is made."""

    space: Callable[[int, int], spaces.Space[Any]]
    build: Callable[[Situation], Any]


OBSERVATIONS: Mapping[str, Observation] = {
    "rgb": Observation(
        lambda width, height: spaces.Box(0, 255, (height, width, 3), np.uint8),
        # A copy: after an illegal action the event, and its frame, are those of the step before.
        lambda situation: np.array(situation.event.frame),
    ),
    "state": Observation(
        lambda width, height: spaces.Box(-1.0, 1.0, (len(STATE_LAYOUT),), np.float32), _state
    ),
    "text": Observation(
        lambda width, height: spaces.Text(_TEXT_LENGTH, min_length=1, charset=_CHARACTERS), _text
    ),
}


def parse_obs_mode(obs_mode: str) -> tuple[str, ...]:
    """The kinds of observation that a mode such as ``"rgb+text"`` asks for.

    Raises:
        ValueError: it names something that is no kind of observation, or nothing, or one twice.
    """
    kinds = tuple(obs_mode.split("+"))
    if len(set(kinds)) < len(kinds) or not set(kinds) <= OBSERVATIONS.keys():
        raise ValueError(
            f"unknown obs_mode {obs_mode!r}; join any of {', '.join(OBSERVATIONS)} with '+', "
            "such as 'rgb+text'"
        )
    return kinds
