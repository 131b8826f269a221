"""Transfers: fetch a thing, put it somewhere else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject, largest, may_put_into
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, from_templates, plan_from
from er_gym.tasks.generate.templates import MOVE
from er_gym.tasks.generate.words import in_or_on_the


def transfer(graph: SceneGraph, obj: SceneObject, target: SceneObject) -> TaskPlan:
    """Fetch a thing and put it into a target."""
    builder = PlanBuilder(graph)
    builder.fetch(obj)
    builder.put(target)
    return plan_from(builder, obj, place=in_or_on_the(target.type))


def transfers(graph: SceneGraph, hidden: bool) -> Iterator[tuple[SceneObject, SceneObject]]:
    """Every exposed or enclosed thing, with one target of each receptacle type that takes it."""
    targets = [target for group in _by_type(graph) if (target := _target_of(graph, group))]
    for obj in graph.pickupable_objects(hidden):
        for target in targets:
            if graph.accepts(obj.type, target.type) and not graph.is_in(obj, target):
                yield obj, target


def _target_of(graph: SceneGraph, group: list[SceneObject]) -> SceneObject | None:
    """The largest of some receptacles of one type, if a transfer may go there.

    None may be open where another is shut: the words do not say which.
    """
    alike = len({obj.closed for obj in group}) == 1
    fit = [obj for obj in group if _is_target(graph, obj)]
    return largest(fit) if fit and alike else None


def _is_target(graph: SceneGraph, obj: SceneObject) -> bool:
    """Whether transfers may go to a thing: a receptacle that stands somewhere one can say.

    What can be carried is gone to where it stands, unless that is the floor.
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
        instructions=from_templates(MOVE),
    )
    for name, hidden, into_closed in (
        ("pickup_and_put", False, False),
        ("pickup_and_put_in_closerep", False, True),
        ("pickup_from_closerep_and_put", True, False),
        ("pickup_from_closerep_and_put_in_closerep", True, True),
    )
)
