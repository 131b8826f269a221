"""What the agent perceives: small builders, each with its own Gymnasium space.

``state`` and ``text`` contain only what an agent can know from the instruction and from what it has
seen and done.
"""

from __future__ import annotations

import re
import string
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from hashlib import blake2b
from math import cos, radians, sin
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from er_gym.envs.arguments import short_repr
from er_gym.envs.asked_goal import GOAL_VERBS, goal
from er_gym.envs.feedback_words import NO_HINT
from er_gym.envs.legality import AvailableObjects, KnownTypes
from er_gym.envs.memory import MAX_REPEATS, REMEMBERED, Memory
from er_gym.envs.object_view import FEATURES as OBJECT_FEATURES
from er_gym.envs.object_view import object_features
from er_gym.envs.perception import SENSORS, Perception
from er_gym.envs.text_space import TextSpace
from er_gym.plugins import PluginError, Registry, is_dotted
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES

_DID = tuple(f"did {verb}" for verb in verbs.OBJECT_VERBS)
FEATURES = (
    *("visible", "seen", "navigable", "interactable", "open", "on", "held", "at"),
    *("goal", "found", "last"),
    *_DID,
)
"""The features of each object type in ``state``, from 0 to 1:

- ``visible``: the agent sees one now; ``seen``: it has seen one in this episode;
- ``navigable``, ``interactable``: as in the action mask;
- ``open``, ``on``: one was open, or switched on, when the agent last saw it;
- ``held``: one is in the hand; ``at``: the agent last navigated to this type;
- ``goal``: the instruction names this type: 1 for the first type that it names, then 1/2, 1/3 …;
- ``found``: the greatest ``goal`` of the types that the agent has seen since it arrived at this
  type; this type itself and the type in the hand do not count;
- ``last``: the last action named this type;
- ``did`` and a verb: how often the agent did the verb to this type in this episode, divided by 4,
  at most 1.
"""
_POSE = ("right", "ahead", "sin", "cos", "horizon", "standing")
_EPISODE = ("steps", "success", "holding", "repeats")
SCALARS = (
    *_POSE,
    *_EPISODE,
    *(f"last {verb}" for verb in (*verbs.BARE_VERBS, *verbs.OBJECT_VERBS)),
    *GOAL_VERBS,
)
"""The features of the agent and the episode in ``state``:

- ``right``, ``ahead``: the agent's offset from its start position, in tens of metres, -1 to 1, in
  the frame of its first view; ``sin``, ``cos``: of the angle that it has turned clockwise since the
  start; ``horizon``: in right angles downwards; ``standing``: 0 or 1;
- ``steps``: the share of the step limit that is used up; ``success``: whether the last action
  succeeded; ``holding``: whether the agent holds something; ``repeats``: how often in a row the
  last action was done, as a share of :data:`MAX_REPEATS`;
- ``last`` and a verb: whether the last action had this verb, 0 or 1;
- :data:`GOAL_VERBS`: whether the words of the instruction ask for this, 0 or 1.
"""
STATE_LAYOUT = (*SCALARS, *(f"{feature}:{name}" for feature in FEATURES for name in TYPES))
"""What each entry of the ``state`` vector means, in order: :data:`SCALARS`, then a row of types for
each of :data:`FEATURES`."""
LAST_ENTRY = {
    verb: SCALARS.index(f"last {verb}") for verb in (*verbs.BARE_VERBS, *verbs.OBJECT_VERBS)
}
ASKED_ENTRIES = slice(len(SCALARS) - len(GOAL_VERBS), len(SCALARS))
FEATURE_ROW = {feature: row for row, feature in enumerate(FEATURES)}
FIRST_DID = FEATURE_ROW[_DID[0]]
"""Where the last action, the verbs asked for, the row of each feature and the rows of what was done
stand in :data:`STATE_LAYOUT`."""
_ROOM_SCALE = 10.0
"""The offsets from the start are divided by this many metres."""
_TEXT_LENGTH = 20_000
_MOST_OBJECTS = 2**31 - 1
"""The bound that the space gives for the number of objects; AI2-THOR sets no limit."""


@dataclass(frozen=True, eq=False)
class Situation:
    """Everything that observations are made from.

    Attributes:
        at: index of the type last navigated to, None before that.
        annotate: whether object types are written into pictures.
        understood: whether the last reply named an action.
        views: after ``observe``, what the agent perceived in each direction.
    """

    perception: Perception
    available: AvailableObjects
    memory: Memory
    known: KnownTypes
    instruction: str
    feedback: str
    at: int | None
    success: bool
    steps: int
    max_steps: int
    annotate: bool = False
    understood: bool = True
    views: Mapping[str, Perception] = field(default_factory=dict)

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """The agent's view as an observation shows it, (height, width, 3) uint8; None where nothing
        is drawn. Read-only."""
        return self.perception.annotated if self.annotate else self.perception.frame


def _relative_pose(situation: Situation) -> tuple[float, ...]:
    """The agent's pose in the frame of its start pose."""
    pose, start = situation.perception.pose, situation.memory.start
    dx, dz = pose.x - start.x, pose.z - start.z
    heading = radians(start.rotation)
    turned = radians(pose.rotation) - heading
    right = dx * cos(heading) - dz * sin(heading)
    ahead = dx * sin(heading) + dz * cos(heading)
    return (
        right / _ROOM_SCALE,
        ahead / _ROOM_SCALE,
        sin(turned),
        cos(turned),
        pose.horizon / 90.0,
        float(pose.standing),
    )


def pose_and_episode(situation: Situation) -> tuple[float, ...]:
    """The first of :data:`SCALARS`, of the agent and the episode; not clipped yet."""
    return (
        *_relative_pose(situation),
        situation.steps / situation.max_steps,
        float(situation.success),
        float(situation.perception.objects.held >= 0),
        situation.memory.repeats / MAX_REPEATS,
    )


def _state(situation: Situation) -> NDArray[np.float32]:
    memory, objects = situation.memory, situation.perception.objects
    last = memory.last
    scalars = pose_and_episode(situation)
    vector = np.zeros(len(STATE_LAYOUT), dtype=np.float32)
    vector[: len(scalars)] = [min(max(each, -1.0), 1.0) for each in scalars]
    vector[ASKED_ENTRIES] = goal(situation.instruction)[0]
    if (
        last is not None and last.verb in LAST_ENTRY
    ):  # the paper's protocol has other verbs and types
        vector[LAST_ENTRY[last.verb]] = 1.0
    table = vector[len(SCALARS) :].reshape(len(FEATURES), len(TYPES))
    table[FEATURE_ROW["visible"]] = situation.perception.visible_types
    table[FEATURE_ROW["seen"]] = memory.seen
    table[FEATURE_ROW["navigable"]] = situation.known.types
    table[FEATURE_ROW["interactable"]] = situation.available.interactable_types
    table[FEATURE_ROW["open"]] = memory.is_open
    table[FEATURE_ROW["on"]] = memory.is_on
    table[FEATURE_ROW["goal"]] = memory.wanted
    table[FEATURE_ROW["found"]] = memory.found
    table[FIRST_DID:] = memory.did
    if last is not None and last.object_type in KIND_OF:
        table[FEATURE_ROW["last"], KIND_OF[last.object_type]] = 1.0
    if objects.held >= 0:
        table[FEATURE_ROW["held"], objects.kinds[objects.held]] = 1.0
    if situation.at is not None:
        table[FEATURE_ROW["at"], situation.at] = 1.0
    return vector


_CHARACTERS = string.ascii_letters + string.digits + string.punctuation + " \n"
_LOOKALIKES = str.maketrans(
    {"‘": "'", "’": "'", "“": '"', "”": '"', "–": "-", "—": "-", "…": "..."}
)


_OTHER = re.compile(f"[^{re.escape(_CHARACTERS)}]")


def _plain(text: str) -> str:
    """Text in the characters that the text space has; others become question marks."""
    return _OTHER.sub("?", text.translate(_LOOKALIKES))[:_TEXT_LENGTH]


TEXTS = ("text_task", "text_caption", "text_targets", "text")
"""The observations in words, each with what it tells beyond the one before:

- ``text_task``: the task, the steps, and whether the last action worked;
- ``text_caption``: what the agent sees and holds;
- ``text_targets``: what it may navigate to, and what is within reach;
- ``text``: why an action did not work.
"""


def text_of(situation: Situation, kind: str = TEXTS[-1]) -> str:
    """One of :data:`TEXTS`. A reply that names no action is told the actions in each of them."""
    perception, much = situation.perception, TEXTS.index(kind)
    hinted = kind == TEXTS[-1] or situation.success or not situation.understood
    lines = [
        f"Task: {situation.instruction}",
        f"Step {situation.steps} of {situation.max_steps}. "
        f"{situation.feedback if hinted else NO_HINT()}",
    ]
    if much >= TEXTS.index("text_caption"):
        lines += [
            f"You see: {', '.join(perception.visible_names) or 'nothing'}.",
            f"You hold: {perception.held_name or 'nothing'}.",
        ]
    if much >= TEXTS.index("text_targets"):
        lines += [
            f"You can navigate to: {', '.join(situation.known.names) or 'nothing'}.",
            f"Within reach: {', '.join(situation.available.in_reach) or 'nothing'}.",
        ]
    return _plain("\n".join(lines))


def text_without_task(text: str, instruction: str) -> str:
    """An observation ``text`` without the task, for those who state that themselves.

    A text that does not begin with this task stays as it is.
    """
    return text.removeprefix(_plain(f"Task: {instruction}\n"))


FAR = 40.0
"""The greatest ``depth``, metres: the value of farther surfaces, and of pixels without one. The
embedded engine draws as far as this."""


def _depth(situation: Situation) -> NDArray[np.float32]:
    depth = situation.perception.depth
    assert depth is not None  # the row asks for it
    return np.asarray(np.clip(depth, 0.0, FAR, dtype=np.float32))  # a copy


def _instance(situation: Situation) -> NDArray[np.int32]:
    return np.array(situation.perception.instances)


def _instance_ids(situation: Situation) -> dict[str, Any]:
    perception = situation.perception
    assert perception.instances is not None  # the row asks for them
    ids = [""] * (len(perception.objects) + 1)
    for number in np.unique(perception.instances).tolist():
        if number:
            ids[number] = perception.objects.ids[number - 1]
    return {"instance_ids": tuple(ids)}


def _object_views(situation: Situation) -> dict[str, Any]:
    around = {name: view.object_views for name, view in situation.views.items()}
    return {"object_views": situation.perception.object_views, "object_views_around": around}


ANCHOR_BYTES = 16


def anchor_of(situation: Situation) -> bytes:
    """A digest of what the agent has observed and done so far, :data:`ANCHOR_BYTES` long.

    Agents that got the same instruction, know the same, stand in the same place, and whose last
    action was the same with the same success, have the same anchor, whichever way they came and
    however many steps it took. So what is earned from there on can be compared between episodes
    (the anchor states of GiGPO, arXiv 2505.10978).
    """
    memory, perception = situation.memory, situation.perception
    told = blake2b(digest_size=ANCHOR_BYTES)
    told.update(
        repr(
            (
                situation.instruction,
                [round(each, 3) for each in _relative_pose(situation)],
                perception.held_name,
                situation.at,
                situation.success,
                memory.last and str(memory.last),
                memory.repeats,
            )
        ).encode(errors="surrogatepass")
    )
    arrays = (
        *(getattr(memory, name) for name in REMEMBERED),
        situation.known.types,
        perception.visible_types,
        situation.available.interactable_types,
    )
    for array in arrays:
        told.update(array.tobytes())
    return told.digest()


def _anchor(situation: Situation) -> NDArray[np.uint8]:
    return np.frombuffer(anchor_of(situation), np.uint8).copy()


def _nothing_to_tell(situation: Situation) -> Mapping[str, Any]:
    return {}


@dataclass(frozen=True)
class Observation:
    """A kind of observation.

    Attributes:
        space: returns the space of the observation, given the width and height of frames, pixels.
        build: makes the observation; it must return a new array, because images are shared.
        needs: the sensors that it reads, keys of :data:`er_gym.envs.perception.SENSORS`:
            ``"frame"`` (``situation.picture``), ``"depth"``, ``"instances"``, ``"classes"`` (each
            an attribute of ``situation.perception``). Nothing is drawn for an observation without
            sensors.
        info: returns what the observation adds to ``info``: the same names each time, and plain
            values of one form (:class:`er_gym.envs.info.Info`).
        details: returns the entries of :class:`er_gym.envs.info.Details` that explain the
            observation, such as what its numbers mean.

    Raises:
        ValueError: there is no such sensor.
    """

    space: Callable[[int, int], spaces.Space[Any]]
    build: Callable[[Situation], Any]
    needs: tuple[str, ...] = ()
    info: Callable[[Situation], Mapping[str, Any]] = _nothing_to_tell
    details: Callable[[Situation], Mapping[str, Any]] = _nothing_to_tell

    def __post_init__(self) -> None:
        known = isinstance(self.needs, tuple) and all(
            isinstance(name, str) and name in SENSORS for name in self.needs
        )
        if not known:
            raise ValueError(
                f"an observation needs {short_repr(self.needs)}; give a tuple of sensors, of "
                f"{', '.join(SENSORS)}"
            )


def sensors_of(rows: Iterable[Observation]) -> frozenset[str]:
    """All sensors that some observations need."""
    return frozenset(name for row in rows for name in row.needs)


OBSERVATIONS: Registry[Observation] = Registry(
    kind="observation",
    group="er_gym.observations",
    own={
        "rgb": Observation(
            lambda width, height: spaces.Box(0, 255, (height, width, 3), np.uint8),
            # A copy: after an illegal action the perception is that of the step before.
            lambda situation: np.array(situation.picture),
            needs=("frame",),
        ),
        "depth": Observation(
            lambda width, height: spaces.Box(0.0, FAR, (height, width), np.float32),
            _depth,
            needs=("depth",),
        ),
        "instance": Observation(
            lambda width, height: spaces.Box(0, _MOST_OBJECTS, (height, width), np.int32),
            _instance,
            needs=("instances",),
            details=_instance_ids,
        ),
        "objects": Observation(
            lambda width, height: spaces.Box(
                -1.0, 1.0, (len(TYPES), len(OBJECT_FEATURES)), np.float32
            ),
            lambda situation: object_features(situation.perception.object_views),
            details=_object_views,
        ),
        "state": Observation(
            lambda width, height: spaces.Box(-1.0, 1.0, (len(STATE_LAYOUT),), np.float32), _state
        ),
        **{
            name: Observation(
                lambda width, height: TextSpace(_TEXT_LENGTH, min_length=1, charset=_CHARACTERS),
                partial(text_of, kind=name),
            )
            for name in TEXTS
        },
        "anchor": Observation(
            lambda width, height: spaces.Box(0, 255, (ANCHOR_BYTES,), np.uint8),
            _anchor,
            info=lambda situation: {"anchor": anchor_of(situation).hex()},
        ),
    },
    expected=f"an {__name__}.Observation",
    fits=lambda row: isinstance(row, Observation),
)
"""The kinds of observation by name. The name is also the key in the observation."""


def parse_obs_mode(obs_mode: str) -> dict[str, Observation]:
    """The kinds of observation that a mode such as ``"rgb+text"`` asks for, by name.

    Raises:
        ValueError: the mode names an unknown kind, nothing, or one kind twice.
    """
    names = obs_mode.split("+") if isinstance(obs_mode, str) else [""]
    try:
        rows = {name: OBSERVATIONS.get(name) for name in names}
    except PluginError as error:
        if any(is_dotted(name) for name in names):
            raise
        raise ValueError(_unknown_mode(obs_mode)) from error
    if len(rows) < len(names):
        raise ValueError(_unknown_mode(obs_mode))
    return rows


def _unknown_mode(obs_mode: object) -> str:
    return (
        f"unknown obs_mode {short_repr(obs_mode)}; join any of {', '.join(OBSERVATIONS.names())} "
        "and package.module:ROW with '+', such as 'rgb+text'"
    )
