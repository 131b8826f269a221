"""The task generator: from AI2-THOR object metadata to tasks of all eleven types.

A kind of task is a :class:`~er_gym.tasks.generate.task_plan.TaskRule`: a task type, which objects
qualify, which key actions follow, and its instructions.
Each family has a module with its rows: ``search``,
``manipulate``, ``transport``, ``composite``; long-range tasks have recipes, which are data
(``recipes.yaml``). A plan is acted out on paper (``builder``), so that key actions and goal agree.

The rules:

- A thing is *exposed* if it lies in something that does not open and that stands free: on the floor
  or on nothing; *enclosed* if it lies in something closed that stands free. Toilets, chairs and
  stools are not gone to.
- A transfer goes to a receptacle whose type accepts the thing's type, not to what it is in already;
  of several receptacles of one type it is the largest. Something that could itself be carried (a
  Bowl) is gone to where it stands. Sinks and bathtubs are filled by their basins.
- Within one task, a type names one receptacle: nothing goes from one CounterTop to another.
- Where several objects fit the words, any of them counts if all ask for the same actions; else the
  words say where the one is that is meant ("the Book that is on the Desk"), and it must be that
  one; else there is no task.

Whether a task can be done is for an agent to show; :mod:`er_gym.envs.verify` asks one.
"""

from er_gym.tasks.generate.generator import Generator, generate_tasks, generator_for
from er_gym.tasks.generate.rules import GENERATED_TYPES
from er_gym.tasks.generate.select import select_balanced

__all__ = ["GENERATED_TYPES", "Generator", "generate_tasks", "generator_for", "select_balanced"]
