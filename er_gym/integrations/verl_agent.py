"""verl-agent: an environment manager of many rooms, for its multi-turn rollout.

verl-agent makes its environments in ``make_envs`` of ``agent_system/environments/env_manager.py``.
There, return :func:`make_envs` of this file for your ``env.env_name``::

    if "er-gym" in config.env.env_name.lower():
        from er_gym.integrations.verl_agent import make_envs
        return make_envs(config)

Each step is a prompt by itself, so the text of an observation tells of the last steps, too.
Pictures are shown if ``env.er_gym.pictures`` says so. The class has the methods of verl-agent's
``EnvironmentManagerBase`` and imports nothing of it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.integrations.session import PROMPT, Session, Turn, action_in

FORM = (
    "First reason about the situation between <think> and </think>, then write the action between "
    "<action> and </action>."
)
IMAGE = "<image>"


class HouseholdManager:
    """Rooms side by side, one for each rollout.

    Args:
        groups: how many tasks are played at once.
        size: rollouts of each task.
        seed: chooses the tasks; each reset draws others.
        history: of how many earlier steps the text tells.
        settings: the arguments of :class:`~er_gym.integrations.session.Session`.
    """

    def __init__(
        self, groups: int, size: int = 1, *, seed: int = 0, history: int = 2, **settings: Any
    ) -> None:
        self._seeds = np.random.default_rng(seed)
        self._size, self._history = size, history
        self._sessions = [Session(**settings) for _ in range(groups * size)]

    def reset(
        self, kwargs: Sequence[dict[str, Any]] | None = None
    ) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        """Begin an episode in each room; the rooms of a group have the same task.

        Args:
            kwargs: for each room, the column ``env_kwargs`` of the data set: ``task_id`` pins the
                room's task.
        """
        pinned = [(each or {}).get("task_id") for each in kwargs or ()]
        pinned += [None] * (len(self._sessions) - len(pinned))
        seeds = self._seeds.integers(2**31, size=len(self._sessions) // self._size)
        turns = [
            session.reset(task, seed=int(seeds[place // self._size]))
            for place, (session, task) in enumerate(zip(self._sessions, pinned, strict=True))
        ]
        self._before = [deque[str](maxlen=self._history) for _ in turns]
        self._turns = turns
        return self._told()

    def step(
        self, text_actions: Sequence[str]
    ) -> tuple[dict[str, Any], NDArray[np.float32], NDArray[np.bool_], list[dict[str, Any]]]:
        """Do the action of each reply in its room; in a room that is done nothing happens.

        Returns:
            The observations: ``text``, a list of texts; ``image``, (rooms, height, width, 3) uint8
            or None; ``anchor``, the states by which GiGPO groups steps. The rewards, (rooms,)
            float32. The ends, (rooms,) bool. And for each room what is known of the step.
        """
        for place, (session, reply) in enumerate(zip(self._sessions, text_actions, strict=True)):
            said = action_in(reply)
            turn = self._turns[place] = session.step(said)
            self._before[place].append(f"{said}: {_outcome(turn)}")
        observations, infos = self._told()
        rewards = np.array([turn.reward for turn in self._turns], dtype=np.float32)
        return observations, rewards, np.array([turn.done for turn in self._turns]), infos

    def success_evaluator(
        self,
        total_infos: Sequence[Sequence[dict[str, Any]]],
        total_batch_list: Sequence[Sequence[dict[str, Any]]],
        **_: Any,
    ) -> dict[str, NDArray[np.float64]]:
        """Whether each episode ended in success, by the last step in which it was under way."""
        won = [
            next(
                (
                    float(info["won"])
                    for info, row in reversed([*zip(infos, rows, strict=False)])
                    if row["active_masks"]
                ),
                0.0,
            )
            for infos, rows in zip(total_infos, total_batch_list, strict=True)
        ]
        return {"success_rate": np.array(won)}

    def close(self) -> None:
        """Stop the simulators."""
        for session in self._sessions:
            session.close()

    def _told(self) -> tuple[dict[str, Any], list[dict[str, Any]]]:
        pictures = [turn.picture for turn in self._turns if turn.picture is not None]
        observations = {
            "text": list(map(_prompt, self._turns, self._before)),
            "image": np.stack(pictures) if pictures else None,
            "anchor": [turn.anchor for turn in self._turns],
        }
        infos = [
            {
                "won": turn.success,
                "is_action_valid": np.array(turn.is_action_valid),
                "task_id": turn.task_id,
                "text": turn.text,
                "progress": turn.progress,
            }
            for turn in self._turns
        ]
        return observations, infos


def make_envs(config: Any) -> tuple[HouseholdManager, HouseholdManager]:
    """The rooms for training and for validation, by verl-agent's configuration.

    ``env.er_gym`` holds the arguments of :class:`HouseholdManager` but the first two, such as
    ``episode_source`` and ``scaffold``; ``env.er_gym_val`` what is otherwise in validation.
    """
    own = dict(config.env.get("er_gym", {}))
    val = {**own, **dict(config.env.get("er_gym_val", {}))}
    seed = config.env.get("seed", 0)
    train = {"seed": seed, **own}
    return (
        HouseholdManager(config.data.train_batch_size, max(config.env.rollout.n, 1), **train),
        HouseholdManager(config.data.val_batch_size, **{"seed": seed + 1000, **val}),
    )


def _outcome(turn: Turn) -> str:
    """What came of the last action: the second line of the text, or all of a shorter one."""
    return turn.text.splitlines()[:2][-1]


def _prompt(turn: Turn, before: Sequence[str]) -> str:
    """All that the model is told at a step."""
    parts = [f"{PROMPT} {FORM}"]
    if before:
        parts.append("\n".join(("Your last actions, and what came of them:", *before)))
    parts.append(turn.text if turn.picture is None else f"{IMAGE}\n{turn.text}")
    return "\n\n".join(parts)
