"""What the families make of a room, and what becomes a task."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from er_gym.tasks import verbs
from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction


@dataclass(frozen=True)
class TaskPlan:
    """How a task is done, and what its instruction is about.

    Attributes:
        subjects: what the instruction speaks of by type alone, so that one has to know which is
            meant: the things that are searched, taken or switched, not where they are put.
        related: ids of what it handles that one does not go to itself.
        words: for the templates, besides the usual ones.
        dirty: ids of what has to be dirty when it begins.
    """

    key_actions: tuple[KeyAction, ...]
    goal: tuple[Condition, ...]
    subjects: tuple[SceneObject, ...]
    related: tuple[str, ...]
    words: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    dirty: tuple[str, ...] = ()

    @property
    def one_object_per_type(self) -> bool:
        """Whether no type stands for two objects among those that the plan acts on."""
        named = {(action.object_type, action.object_id) for action in self.key_actions}
        return len(named) == len({object_type for object_type, _ in named})

    @property
    def scored(self) -> tuple[tuple[str, str], ...]:
        """Verb and type of each key action that success asks for."""
        return tuple(
            (a.verb, a.object_type) for a in self.key_actions if a.verb not in verbs.UNSCORED
        )


def plan_from(
    builder: PlanBuilder,
    *subjects: SceneObject,
    goal: tuple[Condition, ...] | None = None,
    dirty: Iterable[str] = (),
    **words: str | Sequence[str],
) -> TaskPlan:
    """What a script has done, as a plan; its goal is how things are in the end, unless given."""
    handled = dict.fromkeys((*subjects, *builder.handled))
    return TaskPlan(
        builder.key_actions(),
        builder.goal() if goal is None else goal,
        subjects,
        tuple(obj.id for obj in handled),
        words,
        tuple(dirty),
    )


@dataclass(frozen=True)
class TaskRule:
    """A type of task that can be generated.

    Attributes:
        type: a name in :data:`~er_gym.tasks.types.TASK_TYPES`.
        choices: which objects of a room qualify; each choice is a tuple of arguments for ``plan``.
        plan: which key actions follow from a choice. It takes any things at all, those that do not
            qualify too; it may raise :class:`~er_gym.tasks.generate.plan_builder.ImpossiblePlan`.
        sayings: all instructions for a plan, at least a dozen, given the words; the first one words
            the task's name.
        slug: stands for the type in task ids, where its name is no good as a part of a file name or
            says too little; the type's name by default.
        names_places: whether the words may say where a subject is ("the Book that is on the Desk")
            where there are several. In a search they must not.
    """

    type: str
    choices: Callable[[SceneGraph], Iterable[tuple[SceneObject, ...]]]
    plan: Callable[..., TaskPlan]
    instructions: Callable[[Mapping[str, str | Sequence[str]]], Sequence[str]]
    slug: str = ""
    may_name_places: bool = True


def from_templates(
    templates: Sequence[str],
) -> Callable[[Mapping[str, str | Sequence[str]]], Sequence[str]]:
    """Sayings that are templates to be filled with the words."""
    return lambda words: [template.format_map(words) for template in templates]
