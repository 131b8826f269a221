"""The training split: which scenes, object types and wordings training does not see."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from er_gym.tasks import verbs
from er_gym.tasks.task import Task, type_of_id
from er_gym.tasks.wordings.grammar import Wording
from er_gym.tasks.wordings.instructions import wording_of
from er_gym.thor import SCENE_NAMES

# fmt: off
EVALUATION_SCENES = (
    "FloorPlan1", "FloorPlan2", "FloorPlan3",
    "FloorPlan201", "FloorPlan202", "FloorPlan203",
    "FloorPlan301", "FloorPlan302", "FloorPlan303",
    "FloorPlan401", "FloorPlan403", "FloorPlan404",
)
"""The twelve scenes of the paper's test tasks, three of each kind of room."""
_ALSO_HELD_OUT = ("FloorPlan4", "FloorPlan7", "FloorPlan22", "FloorPlan27")
"""Further scenes of the paper's test tasks; the third of its file that we have names 4, 22, 27."""
TRAINING_SCENES = tuple(
    name for name in SCENE_NAMES if name not in (*EVALUATION_SCENES, *_ALSO_HELD_OUT)
)
"""All scenes without a known test task of the paper."""
UNSEEN_TYPES = frozenset({
    "AlarmClock", "Kettle", "Ladle", "Newspaper", "SprayBottle", "Statue", "TissueBox", "Watch",
})
"""Types that no training task searches for, picks up or switches. They stand in training rooms, so
training sees them: they are unseen as goals only."""
STRICTLY_UNSEEN_TYPES = frozenset({"Kettle", "Ladle", "Newspaper", "Watch"})
"""Those of :data:`UNSEEN_TYPES` that stand in none of :data:`STRICT_SCENES`."""
_WITH_STRICTLY_UNSEEN = frozenset({
    "FloorPlan5", "FloorPlan6", "FloorPlan8", "FloorPlan9", "FloorPlan11", "FloorPlan14",
    "FloorPlan15", "FloorPlan16", "FloorPlan17", "FloorPlan18", "FloorPlan20", "FloorPlan25",
    "FloorPlan29", "FloorPlan30", "FloorPlan205", "FloorPlan207", "FloorPlan209", "FloorPlan210",
    "FloorPlan211", "FloorPlan212", "FloorPlan213", "FloorPlan214", "FloorPlan215", "FloorPlan216",
    "FloorPlan217", "FloorPlan218", "FloorPlan219", "FloorPlan222", "FloorPlan224", "FloorPlan225",
    "FloorPlan226", "FloorPlan227", "FloorPlan228", "FloorPlan230", "FloorPlan326",
})
STRICT_SCENES = tuple(name for name in TRAINING_SCENES if name not in _WITH_STRICTLY_UNSEEN)
"""The training scenes in which an agent cannot have seen :data:`STRICTLY_UNSEEN_TYPES`."""
# fmt: on
SCENES: Mapping[str, tuple[str, ...]] = {
    "all": SCENE_NAMES,
    "training": TRAINING_SCENES,
    "strict": STRICT_SCENES,
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


def rooms_kept_for_evaluation(tasks: Iterable[Task]) -> list[str]:
    """The scenes of some tasks that are not :data:`TRAINING_SCENES`, in alphabetical order."""
    return sorted({task.scene for task in tasks} - {*TRAINING_SCENES})


def is_strictly_unseen(subjects: Collection[str]) -> bool:
    """Whether a task with these subjects is about a type that :data:`STRICT_SCENES` never show."""
    return not STRICTLY_UNSEEN_TYPES.isdisjoint(subjects)


def wording(task: Task) -> Wording | None:
    """``seen`` or ``unseen``, by whether training has tasks in the wording of this one; None for an
    instruction that is in no wording of er-gym."""
    return wording_of(task.name, task.instruction)
