"""From a scene's objects to its tasks."""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from er_gym.tasks import verbs
from er_gym.tasks.generate.plan import Plan
from er_gym.tasks.generate.room import Accepts, read_room
from er_gym.tasks.generate.rules import RULES, Rule
from er_gym.tasks.generate.words import a, it
from er_gym.tasks.rooms import room_kind
from er_gym.tasks.task import Task
from er_gym.tasks.types import BY_NAME


def generate_tasks(
    objects: Sequence[Mapping[str, Any]], scene: str, accepts: Accepts
) -> Iterator[Task]:
    """Yield the candidate tasks of a scene, type by type; the same for the same arguments.

    Args:
        objects: ``event.metadata["objects"]`` of the scene as it is when an episode begins.
        scene: its name, such as ``FloorPlan1``.
        accepts: whether a thing of one type may be put into a receptacle of another;
            ``er_gym.thor.accepts`` is AI2-THOR's answer.
    """
    room = read_room(objects, accepts)
    for rule in RULES:
        for plan in rule.plans(room):
            if plan.names_one_place_each:
                yield _task(rule, plan, scene)


def _task(rule: Rule, plan: Plan, scene: str) -> Task:
    subjects = [
        action.object_type
        for action in plan.key_actions
        if action.verb in (verbs.PICKUP, verbs.PUT, verbs.TOGGLE)
    ] or [thing.type for thing in plan.handled]
    task_id = "-".join((scene, rule.slug or rule.type, *subjects))
    subject = plan.handled[0].type
    words = {
        "object": subject,
        "an_object": a(subject),
        "it": it(subject),
        "room": room_kind(scene),
        **plan.words,
    }
    # Not hash(): that differs from process to process.
    template = rule.templates[zlib.crc32(task_id.encode()) % len(rule.templates)]
    gone_to = [action.object_id for action in plan.key_actions if action.verb == verbs.NAVIGATE]
    return Task(
        id=task_id,
        type=BY_NAME[rule.type],
        scene=scene,
        instruction=template.format_map(words),
        name=rule.templates[0].format_map(words),
        key_actions=plan.key_actions,
        target_objects=tuple(dict.fromkeys(gone_to)),
        related_objects=tuple(thing.id for thing in plan.handled),
    )
