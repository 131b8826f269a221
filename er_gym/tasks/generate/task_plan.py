"""A plan for one task, and the rule from which such plans follow."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar, overload

from er_gym.tasks import verbs
from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction


@dataclass(frozen=True)
class TaskPlan:
    """How a task is done, and the words for its instruction.

    Attributes:
        key_actions: in order, ``end`` included.
        goal: the conditions on the final state.
        subjects: the objects that the instruction names by type and that must not be ambiguous:
            those that the agent searches for, picks up or switches, not the receptacles.
        related: ids of the objects that the agent handles without navigating to them.
        words: further words for the templates, such as ``place``.
        dirty: ids of the objects that must be dirty when the episode begins.
    """

    key_actions: tuple[KeyAction, ...]
    goal: tuple[Condition, ...]
    subjects: tuple[SceneObject, ...]
    related: tuple[str, ...]
    words: Mapping[str, str | Sequence[str]] = field(default_factory=dict)
    dirty: tuple[str, ...] = ()

    @property
    def named(self) -> frozenset[tuple[str, str]]:
        """Type and id of each object of the plan's key actions."""
        return frozenset((action.object_type, action.object_id) for action in self.key_actions)

    @property
    def one_object_per_type(self) -> bool:
        """Whether the objects of the plan's key actions all differ in type."""
        return differ_in_type(self.named)

    @property
    def scored(self) -> tuple[tuple[str, str], ...]:
        """Verb and object type of each key action that success requires."""
        return tuple(
            (a.verb, a.object_type) for a in self.key_actions if a.verb not in verbs.UNSCORED
        )


def differ_in_type(named: Collection[tuple[str, str]]) -> bool:
    """Whether objects, each a type and an id, all differ in type."""
    return len(named) == len({object_type for object_type, _ in named})


def plan_from(
    builder: PlanBuilder,
    *subjects: SceneObject,
    goal: tuple[Condition, ...] | None = None,
    dirty: Iterable[str] = (),
    **words: str | Sequence[str],
) -> TaskPlan:
    """The plan that a builder has collected.

    Args:
        builder: the key actions so far.
        subjects: see :class:`TaskPlan`.
        goal: the goal; by default the builder's final state.
        dirty: ids of the objects that must be dirty when the episode begins.
        words: see :class:`TaskPlan`.
    """
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
    """How tasks of one kind are generated.

    Attributes:
        type: a name in :data:`~er_gym.tasks.types.TASK_TYPES`.
        choices: yields the choices of objects in a scene; each is a tuple of arguments for
            ``plan``.
        plan: returns the plan for a choice. It also takes objects that ``choices`` would not yield.
            It raises :class:`~er_gym.tasks.generate.plan_builder.ImpossiblePlan` if they cannot be
            used.
        instructions: returns all instructions for a plan's words, at least twelve. The first is
            also the task's name.
        slug: replaces the type's name in task ids, if that name is too vague or cannot be part of a
            file name.
        may_name_places: whether an instruction may say where an object is ("the Book that is on the
            Desk") to tell it from others. Searches must not.
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
    """Instructions from templates, which are filled with the plan's words."""
    return lambda words: Filled(templates, lambda template: template.format_map(words))


_Template = TypeVar("_Template")


class Filled(Sequence[str]):
    """Instructions from templates, each made when it is asked for: of hundreds, one or two are."""

    def __init__(self, templates: Sequence[_Template], fill: Callable[[_Template], str]) -> None:
        self._templates, self._fill = templates, fill

    def __len__(self) -> int:
        return len(self._templates)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        if isinstance(index, slice):
            return Filled(self._templates[index], self._fill)
        return self._fill(self._templates[index])
