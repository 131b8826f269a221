"""Verifies that a task can be done: the solver plays it on the embedded engine."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Protocol

from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import verbs
from er_gym.tasks.difficulty import difficulty
from er_gym.tasks.generate import Generator
from er_gym.tasks.generate.generator import DONE_ALREADY
from er_gym.tasks.goal import Condition
from er_gym.tasks.splits import UNSEEN_TYPES, subject_types
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.tasks.task import AgentPose, Task
from er_gym.tasks.types import TASK_TYPES

REASONS = (
    DONE_ALREADY,
    "there is no room to put it",
    "it is nowhere to be found or out of reach",
    "the step limit",
    "the goal does not hold in the end",
    "a key action is worth nothing",
)
(_, _NO_ROOM, _NOT_FOUND, _STEP_LIMIT, _GOAL, _REWARD) = REASONS


@dataclass(frozen=True)
class Verdict:
    """The result of playing a task.

    Attributes:
        problem: one of :data:`REASONS`, ``""`` for a task that can be done.
        detail: the last feedback; of a goal that holds from the start, its conditions.
        steps: the number of steps, the placing of the agent included.
        start: x and z of the agent's start position, metres.
    """

    problem: str
    detail: str
    steps: int
    start: tuple[float, float]

    @property
    def solved(self) -> bool:
        """Whether the task can be done."""
        return not self.problem


class PlayableEnv(Protocol):
    """What a verifier needs of its environment; an ``EmbodiedEnv`` has it."""

    @property
    def agent_pose(self) -> AgentPose:
        """The agent's pose now."""

    @property
    def unmet_now(self) -> tuple[Condition, ...]:
        """The conditions of the task's goal that do not hold now."""

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Begin an episode."""

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Do an action."""

    def close(self) -> None:
        """Stop the engine."""


class Verifier:
    """Plays tasks, one after another, in an environment that it owns; :meth:`close` it at the end.

    A task passes if the solver succeeds within the step limit and earns the whole reward, and if
    the goal does not hold from the start.

    Args:
        env: any environment; ``obs_mode="state"`` is the fastest.
    """

    def __init__(self, env: PlayableEnv) -> None:
        self._env = env
        self._starts: dict[str, tuple[float, float]] = {}

    def start_of(self, scene: str) -> tuple[float, float]:
        """x and z of the start position in a scene, the same for every arrangement; metres."""
        if scene not in self._starts:
            nothing = Task("nothing", TASK_TYPES[0], scene, "", ())
            self._env.reset(options={"task": nothing})
            pose = self._env.agent_pose
            self._starts[scene] = (pose.x, pose.z)
        return self._starts[scene]

    def __call__(self, task: Task) -> Verdict:
        """Play a task."""
        _, told = self._env.reset(seed=0, options={"task": task})
        info = with_details(self._env, told)
        pose = self._env.agent_pose
        where = (pose.x, pose.z)
        if task.goal and not self._env.unmet_now:
            return Verdict(DONE_ALREADY, "; ".join(map(str, task.goal)), 1, where)
        solver = Solver()
        earned, over = 0.0, False
        while not over:
            action, _ = solver.next(info)
            _, reward, terminated, truncated, told = self._env.step(action)
            info = with_details(self._env, told)
            earned += float(reward)
            over = terminated or truncated
        problem = ""
        if not info["success"]:
            problem = _problem(info["end_reason"], info["verb"], bool(info["goal_unmet"]))
        elif abs(earned - task.total_reward) > 1e-6:
            problem = _REWARD
        detail = " ".join(info["feedback"].split())
        return Verdict(problem, detail, info["steps"], where)

    def close(self) -> None:
        """Stop the environment."""
        self._env.close()


def rejection_reason(task: Task, room: Generator, spec: SuiteSpec, verify: Verifier) -> str:
    """Why a generated task does not fit the suite, ``""`` if it fits; nothing is played."""
    if not spec.unseen_objects and UNSEEN_TYPES & subject_types(task):
        return "it is about things that training never sees"
    if spec.allows_any_difficulty:
        return ""
    figures = difficulty(task, room.objects, verify.start_of(task.scene))
    return "" if spec.admits(figures) else "it is not as difficult as asked"


def with_difficulty(task: Task, room: Generator, verdict: Verdict) -> Task:
    """The task with its difficulty and the solver's number of steps in ``extra["difficulty"]``."""
    figures = difficulty(task, room.objects, verdict.start)
    told = {**asdict(figures), "distance": round(figures.distance, 2), "steps": verdict.steps}
    return replace(task, extra={**task.extra, "difficulty": told})


def _problem(end_reason: str, verb: str, goal_unmet: bool) -> str:
    if goal_unmet:
        return _GOAL
    if end_reason == "step limit":
        return _STEP_LIMIT
    return _NO_ROOM if verb == verbs.PUT else _NOT_FOUND
