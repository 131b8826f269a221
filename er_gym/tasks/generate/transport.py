"""Transfers: fetch an object and put it into another receptacle."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject, largest, may_put_into
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, from_templates, plan_from
from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.words import in_or_on_the


def transfer(graph: SceneGraph, obj: SceneObject, target: SceneObject) -> TaskPlan:
    """The plan to fetch an object and put it into a target."""
    builder = PlanBuilder(graph)
    builder.fetch(obj)
    builder.put(target)
    return plan_from(builder, obj, place=in_or_on_the(target.type))


def transfers(graph: SceneGraph, hidden: bool) -> Iterator[tuple[SceneObject, SceneObject]]:
    """Every exposed or enclosed object, with one target of each receptacle type that accepts it."""
    targets = [target for group in _by_type(graph) if (target := _target_of(graph, group))]
    for obj in graph.pickupable_objects(hidden):
        for target in targets:
            if graph.accepts(obj.type, target.type) and not graph.is_in(obj, target):
                yield obj, target


def _target_of(graph: SceneGraph, group: list[SceneObject]) -> SceneObject | None:
    """The largest receptacle of one type that can be a target; None if there is none.

    All receptacles of the type must be open, or all closed: the instruction does not say which one
    is meant.
    """
    alike = len({obj.closed for obj in group}) == 1
    fit = [obj for obj in group if _is_target(graph, obj)]
    return largest(fit) if fit and alike else None


def _is_target(graph: SceneGraph, obj: SceneObject) -> bool:
    """Whether an object can be the target of transfers.

    The agent reaches a pickupable receptacle by way of the place where it stands, so that place
    must be exposed, or the receptacle must stand free.
    """
    return (obj.receptacle and may_put_into(obj)) and (
        not obj.pickupable or graph.is_exposed(obj) or graph.stands_free(obj)
    )


def _by_type(graph: SceneGraph) -> Iterable[list[SceneObject]]:
    groups: dict[str, list[SceneObject]] = {}
    for obj in graph.objects.values():
        groups.setdefault(obj.type, []).append(obj)
    return groups.values()


def _moves(
    graph: SceneGraph, hidden: bool, into_closed: bool
) -> Iterator[tuple[SceneObject, SceneObject]]:
    return (move for move in transfers(graph, hidden) if move[1].closed == into_closed)


RULES = tuple(
    TaskRule(
        name,
        choices=partial(_moves, hidden=hidden, into_closed=into_closed),
        plan=transfer,
        instructions=from_templates(ENGLISH.templates["move"].seen),
    )
    for name, hidden, into_closed in (
        ("pickup_and_put", False, False),
        ("pickup_and_put_in_closerep", False, True),
        ("pickup_from_closerep_and_put", True, False),
        ("pickup_from_closerep_and_put_in_closerep", True, True),
    )
)
