"""A first, simple task generator: from AI2-THOR object metadata to tasks of all eleven types.

A kind of task is a row of the table in :mod:`~er_gym.tasks.generate.rules`: a task type, a function
that makes all its plans for a room (one module per family), and templates for its instruction.

The rules:

- What a task handles (picks up, toggles, looks for) is the only thing of its type in the scene,
  so that the instruction names one thing.
- It is *exposed* if it lies in something that does not open and that stands free: on the floor or
  on nothing; *enclosed* if it lies in something closed that stands free. Chairs and stools are not
  gone to: their boxes reach under tables, so the scenes put things into both.
- A transfer goes to a receptacle whose type accepts the thing's type; of several receptacles of
  one type it is the largest. Something that could itself be carried (a Bowl) is gone to where it
  stands.
- Within one task, a type names one receptacle: nothing goes from one CounterTop to another.
- A long-range task is a transfer with washing on the way: the thing is laid in the SinkBasin, the
  Faucet is turned on, and the thing is taken out again and put away. The scene has one SinkBasin
  and one Faucet, no more than a metre apart, and no bathtub's basin is nearer to the Faucet; what
  comes from the sink, or goes there in the end, is not washed. The water is left running.

Whether a task can be done is for an agent to show: :func:`select_balanced` asks before it takes a
task.
"""

from er_gym.tasks.generate.generator import generate_tasks
from er_gym.tasks.generate.rules import GENERATED_TYPES
from er_gym.tasks.generate.select import select_balanced

__all__ = ["GENERATED_TYPES", "generate_tasks", "select_balanced"]
