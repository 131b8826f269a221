"""A type of task of another package: docs/extending.md."""

from collections.abc import Iterator

from er_gym.tasks.generate.plan_builder import PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, from_templates, plan_from
from er_gym.tasks.types import MANIPULATE, TaskType, register


def shut_things(graph: SceneGraph) -> Iterator[tuple[SceneObject]]:
    """Everything that stands free and is shut."""
    return ((obj,) for obj in graph.objects.values() if obj.closed and not obj.pickupable)


def leave_open(graph: SceneGraph, obj: SceneObject) -> TaskPlan:
    """Go there and open it."""
    builder = PlanBuilder(graph)
    builder.go_to(obj, obj)
    builder.open(obj)
    builder.set_state(obj, isOpen=True)
    return plan_from(builder, obj)


SAYINGS = ("Open {an_object}.", "Leave the {object} open.", "Would you open {an_object}?")
OPEN = register(
    TaskType(
        name="single_open",
        title="Opening",
        group=MANIPULATE,
        env_id="Household-Open-v0",
        max_steps=24,
        rules=(TaskRule("single_open", shut_things, leave_open, from_templates(SAYINGS)),),
    )
)
