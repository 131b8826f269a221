"""The table of task types, one row for each; no other file states facts about single types.

Names, groups and step limits are the paper's (Embodied-Reasoner, arXiv 2503.21696).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

SEARCH, MANIPULATE, TRANSPORT, COMPOSITE = "Search", "Manipulate", "Transport", "Composite"
GROUPS = (SEARCH, MANIPULATE, TRANSPORT, COMPOSITE)
"""The groups, in the order of the paper's result table."""


@dataclass(frozen=True)
class TaskType:
    """A kind of task.

    Attributes:
        name: the name in the paper's task files (``tasktype``).
        title: the name in the paper's text.
        group: one of :data:`GROUPS`.
        env_id: the Gymnasium id of the environment with tasks of this type.
        max_steps: an episode's step limit; placing the agent counts as the first step.
        ordered: whether key actions count only in the order in which they are listed.
        search: whether the task is a search: on ``end`` the target must be within reach.
    """

    name: str
    title: str
    group: str
    env_id: str
    max_steps: int
    ordered: bool = False
    search: bool = False

    def __reduce__(self) -> tuple[Callable[[str], TaskType], tuple[str]]:
        # Unpickled in another process, a row is that row of the table again.
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
    """Look up a task type by the paper's name or by its environment id.

    Raises:
        ValueError: there is no such type; the message lists the known types.
    """
    found = BY_NAME.get(name) or BY_ENV_ID.get(name) if isinstance(name, str) else None
    if found is None:
        raise ValueError(f"unknown task type {name!r}; choose one of: {', '.join(BY_NAME)}")
    return found
