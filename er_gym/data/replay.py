"""Replays a trajectory in an environment, and compares turn by turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.data.pictures import difference
from er_gym.data.trajectory import SeenObject, Trajectory, Turn
from er_gym.envs.actions import NO_ACTION
from er_gym.envs.info import with_details
from er_gym.rollout.play import Playable
from er_gym.rollout.records import ERROR
from er_gym.tasks.reading import read_bytes
from er_gym.tasks.task import Task
from er_gym.writing import inside, writable

_AHEAD = "ahead"
_LONGEST = 120
"""Characters of a value that a message quotes."""


def replay(
    env: Playable, task: Task, trajectory: Trajectory, folder: Path | None = None
) -> Iterator[str]:
    """Repeat a trajectory's actions; yield one line for each difference from the record.

    After the first turn with a difference the rest is not compared, since it mostly follows.

    Args:
        env: with the observation ``objects``, and ``rgb`` if pictures are compared; otherwise like
            the one in which the trajectory was played, faults included.
        task: the trajectory's.
        trajectory: what was recorded.
        folder: the collection's, to compare pictures; None to leave them out.
    """
    obs, told = env.reset(seed=trajectory.seed, options={"task": task})
    info = with_details(env, told)
    over = False
    for index, turn in enumerate(trajectory.turns):
        if over:
            yield f"turn {index}: the episode is over before it ({info['end_reason']})"
            return
        found = [*_perceived(turn, info)]
        if folder is not None:
            found += _pictured(turn, obs, info, folder)
        action = NO_ACTION if turn.verb == ERROR else turn.action
        obs, reward, terminated, truncated, told = env.step(action)
        info = with_details(env, told)
        over = terminated or truncated
        found += _came_of(turn, info, float(reward))
        if found:
            yield from (f"turn {index}: {problem}" for problem in found)
            return
    if not over:
        yield "the episode goes on after the last turn"
        return
    yield from _compared("success", trajectory.success, bool(info["success"]))
    yield from _compared("end_reason", trajectory.end_reason, info["end_reason"])


def _perceived(turn: Turn, info: Mapping[str, Any]) -> Iterator[str]:
    """What the agent perceived before the turn's action."""
    yield from _compared("view", turn.view, [SeenObject.of(one) for one in info["object_views"]])
    around = {
        name: [SeenObject.of(one) for one in views]
        for name, views in info["object_views_around"].items()
    }
    yield from _compared("views", turn.views, around)
    yield from _compared("held", turn.held, info["held"])
    for name in ("navigable", "interactable"):
        yield from _compared(name, getattr(turn, name), list(info[name]))


def _came_of(turn: Turn, info: Mapping[str, Any], reward: float) -> Iterator[str]:
    """What came of the turn's action."""
    done = bool(info["action_success"]) and bool(info["verb"])
    yield from _compared("success", turn.success, done)
    yield from _compared("reward", turn.reward, reward)
    yield from _compared("object_id", turn.object_id, info["object_id"])
    yield from _compared("fault", turn.fault, info["fault"])
    if turn.verb != ERROR:  # that feedback quotes what was said
        yield from _compared("feedback", turn.feedback, writable(info["feedback"]))


def _pictured(
    turn: Turn, obs: Mapping[str, Any], info: Mapping[str, Any], folder: Path
) -> Iterator[str]:
    """The pictures that the agent was shown before the turn's action."""
    frames: dict[str, NDArray[np.uint8]] = {_AHEAD: obs["rgb"], **info["views"]}
    for picture in turn.pictures:
        frame = frames.get(picture.direction)
        if frame is None:
            yield f"picture {picture.path}: there is no view {picture.direction!r} at this turn"
            continue
        try:
            recorded = read_bytes(inside(folder, picture.path))
        except ValueError as error:
            yield f"picture {picture.path} cannot be read: {error}"
            continue
        if problem := difference(recorded, frame):
            yield f"picture {picture.path} {problem}"


def _compared(what: str, recorded: Any, now: Any) -> Iterator[str]:
    if recorded != now:
        yield f"{what} is {_short(now)}, recorded was {_short(recorded)}"


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
