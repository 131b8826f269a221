"""The training split: which scenes and object types training does not see."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from er_gym.tasks import verbs
from er_gym.tasks.task import Task, type_of_id
from er_gym.thor import SCENE_NAMES

# fmt: off
EVALUATION_SCENES = (
    "FloorPlan1", "FloorPlan2", "FloorPlan3",
    "FloorPlan201", "FloorPlan202", "FloorPlan203",
    "FloorPlan301", "FloorPlan302", "FloorPlan303",
    "FloorPlan401", "FloorPlan403", "FloorPlan404",
)
"""The twelve scenes of the paper's test tasks, three of each kind of room."""
_ALSO_HELD_OUT = ("FloorPlan4", "FloorPlan22", "FloorPlan27")
"""Further scenes of the long-range tasks in the paper's test file."""
TRAINING_SCENES = tuple(
    name for name in SCENE_NAMES if name not in (*EVALUATION_SCENES, *_ALSO_HELD_OUT)
)
"""All scenes without a test task of the paper that was known when ``train`` was made."""
VALIDATION_SCENES = tuple(name for name in TRAINING_SCENES if name != "FloorPlan7")
"""The training scenes without FloorPlan7, where one of the paper's test tasks plays."""
UNSEEN_TYPES = frozenset({
    "AlarmClock", "Kettle", "Ladle", "Newspaper", "SprayBottle", "Statue", "TissueBox", "Watch",
})
"""Types that no training task searches for, picks up or switches."""
# fmt: on
SCENES: Mapping[str, tuple[str, ...]] = {
    "all": SCENE_NAMES,
    "training": TRAINING_SCENES,
    "validation": VALIDATION_SCENES,
    "evaluation": EVALUATION_SCENES,
}
"""Sets of scenes by name."""


_ABOUT_PLACES = frozenset({verbs.PUT, verbs.OPEN, verbs.CLOSE})
"""Interactions with an object's receptacle rather than with the object."""


def subject_types(task: Task) -> frozenset[str]:
    """The types that a task searches for, picks up, switches, slices and so on."""
    acted_on = {action.actual_type for action in task.key_actions if is_about(action.verb)}
    return frozenset(acted_on or {type_of_id(object_id) for object_id in task.related_objects})


def is_about(verb: str) -> bool:
    """Whether the object of a key action with this verb is a subject of the task."""
    return verb in verbs.INTERACTIONS and verb not in _ABOUT_PLACES


def split(task: Task) -> str:
    """How new a task is to an agent that was trained on the training split.

    Returns:
        ``seen``, ``unseen room``, ``unseen object`` or ``unseen room and object``.
    """
    return split_of(task.scene, subject_types(task))


def split_of(scene: str, subjects: Collection[str]) -> str:
    """The same for a task in a scene, given its subjects (:func:`subject_types`)."""
    new_room = scene.removesuffix("_physics") not in TRAINING_SCENES
    new_object = not UNSEEN_TYPES.isdisjoint(subjects)
    new = [name for name, is_new in (("room", new_room), ("object", new_object)) if is_new]
    return f"unseen {' and '.join(new)}" if new else "seen"
