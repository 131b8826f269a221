"""Two transfers in order."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import cycle, islice

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.task_plan import (
    TaskPlan,
    TaskRule,
    differ_in_type,
    from_templates,
    plan_from,
)
from er_gym.tasks.generate.transport import transfer, transfers
from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.words import in_or_on_the

_PARTNERS = 2
"""How many second transfers follow each first one."""


def sequence(
    graph: SceneGraph,
    obj: SceneObject,
    target: SceneObject,
    second: SceneObject,
    where: SceneObject,
) -> TaskPlan:
    """The plan to put an object into a target, then a second object into a second target."""
    builder = PlanBuilder(graph)
    builder.fetch(obj)
    builder.put(target)
    builder.fetch(second)
    builder.put(where)
    return plan_from(
        builder, obj, second, place=in_or_on_the(target.type), second_place=in_or_on_the(where.type)
    )


def _sequences(graph: SceneGraph) -> Iterator[tuple[SceneObject, ...]]:
    """Some pairs of transfers: each transfer is the first one of a few pairs."""
    moves = [*transfers(graph, hidden=False), *transfers(graph, hidden=True)]
    # Two independent transfers name in sequence what each names alone, and planning every pair
    # would take most of the time of a house.
    named = [transfer(graph, *move).named for move in moves]
    for index, (obj, target) in enumerate(moves):
        if not differ_in_type(named[index]):
            continue
        start = index + len(moves) // 2
        partners = islice(cycle(zip(moves, named, strict=True)), start, start + len(moves))
        choices = (
            (obj, target, second, where)
            for (second, where), others in partners
            if _independent(obj, target, second, where) and differ_in_type(named[index] | others)
        )
        yield from islice(choices, _PARTNERS)


def _independent(*objects: SceneObject) -> bool:
    """Whether all objects and targets differ in type, so that neither transfer undoes the other."""
    return len({obj.type for obj in objects}) == len(objects)


RULES = (
    TaskRule(
        "ordered_pickup_two_object_and_put",
        choices=_sequences,
        plan=sequence,
        instructions=from_templates(ENGLISH.templates["move two"].seen),
    ),
)
