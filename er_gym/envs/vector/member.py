"""An environment of which many can step together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium
from gymnasium.wrappers import TimeLimit

from er_gym.envs.actions import AnyAction
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.episode import ResetResult, StepResult
from er_gym.envs.faults import FaultPlan
from er_gym.envs.protocol import DEFAULT
from er_gym.envs.vector.group import Group, MemberEpisode
from er_gym.tasks.task import Task


class MemberEnv(EmbodiedEnv):
    """An :class:`~er_gym.envs.embodied_env.EmbodiedEnv` that can step together with others.

    It takes the same arguments and does the same.
    """

    _episode_type = MemberEpisode
    _group: Group | None = None
    _row = 0
    _done: tuple[AnyAction, StepResult] | None = None

    @property
    def can_join(self) -> bool:
        """Whether nothing has to look at each step at once."""
        return self._settings.protocol is DEFAULT and self.render_mode != "human"

    @property
    def is_member(self) -> bool:
        """Whether it has joined a group."""
        return self._group is not None

    def join(self, group: Group, row: int) -> None:
        """Become a member of a group, from the next episode on."""
        self._group, self._row = group, row

    def act(self, action: AnyAction) -> StepResult:
        """Do an action now, which the next ``step`` returns; within :meth:`Group.together`."""
        answer = super().step(action)
        self._done = action, answer
        return answer

    def forget(self) -> None:
        """The next ``step`` shall do its own action."""
        self._done = None

    def step(self, action: AnyAction) -> StepResult:
        """Do an action; see :class:`~er_gym.envs.embodied_env.EmbodiedEnv`."""
        if self._done is None:
            return super().step(action)
        (done, answer), self._done = self._done, None
        if done is not action and done != action:
            raise gymnasium.error.Error(
                f"a wrapper changed the action {done!r} into {action!r}; in a vector environment, "
                "wrappers cannot change actions"
            )
        return answer

    def _begin(self, task: Task, faults: FaultPlan | None, replies: int | None) -> ResetResult:
        self._done = None
        return self._joined(super()._begin(task, faults, replies))

    def _resume(self, task: Task, state: Mapping[str, Any], replies: int | None) -> ResetResult:
        self._done = None
        return self._joined(super()._resume(task, state, replies))

    def _joined(self, answer: ResetResult) -> ResetResult:
        if self._group is not None:
            assert isinstance(self._episode, MemberEpisode)
            self._episode.join(self._group, self._row)
        return answer


def can_act_ahead(env: gymnasium.Env[Any, Any]) -> bool:
    """Whether an environment can step together with others.

    Its wrappers must look at it only after its step, as Gymnasium's ``TimeLimit`` does, and those
    that say so by a class attribute, ``looks_after_step = True``. An environment by the rules of
    the paper's program looks itself, and a window shows each step.
    """
    while isinstance(env, gymnasium.Wrapper):
        if not isinstance(env, TimeLimit) and not getattr(type(env), "looks_after_step", False):
            return False
        env = env.env
    return isinstance(env, MemberEnv) and env.can_join


def act_ahead(group: Group, turns: Sequence[tuple[gymnasium.Env[Any, Any], AnyAction]]) -> None:
    """Let members of a group do the actions that their next ``step`` is asked for.

    Args:
        group: theirs.
        turns: an environment each, wrapped or not, and its action; others than members are left
            as they are.
    """
    members = [(env.unwrapped, action) for env, action in turns]
    acted: list[MemberEnv] = []
    try:
        with group.together():
            for member, action in members:
                if isinstance(member, MemberEnv) and member.is_member:
                    member.act(action)
                    acted.append(member)
    except BaseException:  # nobody will ask for these answers
        for member in acted:
            member.forget()
        raise
