"""Tasks for an agent: their types, files and suites, and the judge of an episode."""

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.suites import Suite, load_suite, suite_from_file, suite_names
from er_gym.tasks.task import AgentPose, KeyAction, Task
from er_gym.tasks.types import GROUPS, TASK_TYPES, TaskType, task_type

__all__ = [
    "GROUPS",
    "TASK_TYPES",
    "AgentPose",
    "KeyAction",
    "Suite",
    "Task",
    "TaskFileError",
    "TaskType",
    "load_suite",
    "suite_from_file",
    "suite_names",
    "task_type",
]
