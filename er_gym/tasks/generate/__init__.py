"""The task generator: from AI2-THOR object metadata to tasks of all eleven types.

A kind of task is a :class:`~er_gym.tasks.generate.task_plan.TaskRule`: a task type, the choice of
objects, the plan for a choice, and the instructions. The modules ``search``, ``manipulate``,
``transport`` and ``composite`` have the rules of one family each. Long-range tasks come from
recipes, which are data (``recipes.yaml``). A
:class:`~er_gym.tasks.generate.plan_builder.PlanBuilder` derives both the key actions and the goal
of a plan, so that they agree.

All rules have this in common:

- A receptacle stands free if it stands on the floor or on nothing. An object is *exposed* if it
  lies in a free-standing receptacle that does not open, and *enclosed* if it lies in a
  free-standing receptacle that is closed. No task sends the agent to a toilet, chair or stool.
- A transfer goes to a receptacle whose type accepts the object's type and that does not hold the
  object already. Among receptacles of one type, the largest is the target. To reach a receptacle
  that can itself be picked up (a Bowl), the agent goes to where it stands. Objects go into the
  basins of sinks and bathtubs.
- Within one task, a type names one receptacle: no task moves an object from one CounterTop to
  another.
- If several objects fit an instruction, any of them counts, provided that all need the same
  actions. Otherwise the instruction says where the object is ("the Book that is on the Desk"), and
  only that object counts. If that is not possible either, there is no task.

The generator does not check whether a task can be done: :mod:`er_gym.envs.verify` has an agent
play it.
"""

from er_gym.tasks.generate.generator import Generator, generate_tasks, generator_for
from er_gym.tasks.generate.rules import GENERATED_TYPES, generated_types
from er_gym.tasks.generate.select import select_balanced

__all__ = [
    "GENERATED_TYPES",
    "Generator",
    "generate_tasks",
    "generated_types",
    "generator_for",
    "select_balanced",
]
