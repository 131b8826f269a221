"""The table of task types: one row each, and nothing about them is written down anywhere else.

Names, groups and step limits are the paper's (Embodied-Reasoner, arXiv 2503.21696).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SEARCH, MANIPULATE, TRANSPORT, COMPOSITE = "Search", "Manipulate", "Transport", "Composite"
GROUPS = (SEARCH, MANIPULATE, TRANSPORT, COMPOSITE)
"""In the order of the paper's result table."""


@dataclass(frozen=True)
class TaskType:
    """A kind of task.

    Attributes:
        name: as the paper's task files write it (``tasktype``).
        title: as the paper's text calls it.
        group: one of :data:`GROUPS`.
        env_id: the Gymnasium id under which episodes of this type can be made.
        max_steps: an episode's step limit; placing the agent counts as the first step.
        ordered: whether key actions count only in the order in which they are listed.
        search: whether the task is done by finding, that is, ``end`` asks to see the target.
    """

    name: str
    title: str
    group: str
    env_id: str
    max_steps: int
    ordered: bool = False
    search: bool = False

    def __reduce__(self) -> tuple[Callable[[str], TaskType], tuple[str]]:
        # A row stays the row of the table when it goes to another process.
        return task_type, (self.name,)


# fmt: off
TASK_TYPES = (
    TaskType("single_search", "Exposed Object Search", SEARCH, "ER-SingleSearch-v0", 22, search=True),
    TaskType("single_search_from_closerep", "Enclosed Object Search", SEARCH, "ER-SingleSearchFromCloserep-v0", 22, search=True),
    TaskType("single_pickup", "Exposed Object Grasping", MANIPULATE, "ER-SinglePickup-v0", 24),
    TaskType("single_pickup_from_closerep", "Enclosed Object Grasping", MANIPULATE, "ER-SinglePickupFromCloserep-v0", 24),
    TaskType("single_toggle", "Exposed Object Toggle", MANIPULATE, "ER-SingleToggle-v0", 24),
    TaskType("pickup_and_put", "Exposed-to-Exposed Object Transfer", TRANSPORT, "ER-PickupAndPut-v0", 30),
    TaskType("pickup_and_put_in_closerep", "Exposed-to-Enclosed Object Transfer", TRANSPORT, "ER-PickupAndPutInCloserep-v0", 30),
    TaskType("pickup_from_closerep_and_put", "Enclosed-to-Exposed Object Transfer", TRANSPORT, "ER-PickupFromCloserepAndPut-v0", 30),
    TaskType("pickup_from_closerep_and_put_in_closerep", "Enclosed-to-Enclosed Object Transfer", TRANSPORT, "ER-PickupFromCloserepAndPutInCloserep-v0", 30),
    TaskType("ordered_pickup_two_object_and_put", "Sequential Object Transfer", COMPOSITE, "ER-OrderedPickupTwoObjectAndPut-v0", 36, ordered=True),
    TaskType("long-range tasks with dependency relationships", "Long-Range Task with Dependencies", COMPOSITE, "ER-LongRange-v0", 36),
)
# fmt: on

BY_NAME = {task_type.name: task_type for task_type in TASK_TYPES}
BY_ENV_ID = {task_type.env_id: task_type for task_type in TASK_TYPES}


def task_type(name: str) -> TaskType:
    """Look a task type up by the paper's name for it or by its environment id.

    Raises:
        ValueError: there is no such type; the message lists those there are.
    """
    found = BY_NAME.get(name) or BY_ENV_ID.get(name) if isinstance(name, str) else None
    if found is None:
        raise ValueError(f"unknown task type {name!r}; choose one of: {', '.join(BY_NAME)}")
    return found
