"""Replays a trajectory in an environment, and compares turn by turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from er_gym.data.comparing import compared
from er_gym.data.reenactment import Reenactment
from er_gym.data.shown_pictures import Album
from er_gym.data.trajectory import SeenObject, Trajectory, Turn
from er_gym.envs.actions import NO_ACTION
from er_gym.envs.feedback import as_now
from er_gym.envs.info import with_details
from er_gym.rollout.play import Playable
from er_gym.rollout.records import ERROR
from er_gym.tasks.task import Task
from er_gym.writing import writable


def replay(
    env: Playable,
    task: Task,
    trajectory: Trajectory,
    album: Album,
    reenactment: Reenactment | None = None,
) -> Iterator[str]:
    """Repeat a trajectory's actions; yield one line for each difference from the record.

    After the first turn with a difference the rest is not compared, since it mostly follows.

    Args:
        env: with the observation ``objects``, and ``rgb`` if pictures are compared; otherwise like
            the one in which the trajectory was played, faults included.
        task: the trajectory's.
        trajectory: what was recorded.
        album: the pictures of its part.
        reenactment: how its agent decides; None if nothing tells.
    """
    obs, told = env.reset(seed=trajectory.seed, options={"task": task})
    info = with_details(env, told)
    over = False
    yield from compared("max_steps", trajectory.max_steps, info["max_steps"])
    for index, turn in enumerate(trajectory.turns):
        if over:
            yield f"turn {index}: the episode is over before it ({info['end_reason']})"
            return
        found = [*_perceived(turn, info), *album.problems(trajectory, index, obs, info)]
        if reenactment is not None:
            for name, now in reenactment.decide(obs, info).items():
                found += compared(name, getattr(turn, name), now, "the seed, played anew")
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
    yield from compared("success", trajectory.success, bool(info["success"]))
    yield from compared("end_reason", trajectory.end_reason, info["end_reason"])


def _perceived(turn: Turn, info: Mapping[str, Any]) -> Iterator[str]:
    """What the agent perceived before the turn's action."""
    yield from compared("view", turn.view, [SeenObject.of(one) for one in info["object_views"]])
    around = {
        name: [SeenObject.of(one) for one in views]
        for name, views in info["object_views_around"].items()
    }
    yield from compared("views", turn.views, around)
    yield from compared("the order of views", [*turn.views], [*around])
    yield from compared("held", turn.held, info["held"])
    for name in ("navigable", "interactable"):
        yield from compared(name, getattr(turn, name), list(info[name]))


def _came_of(turn: Turn, info: Mapping[str, Any], reward: float) -> Iterator[str]:
    """What came of the turn's action."""
    done = bool(info["action_success"]) and bool(info["verb"])
    yield from compared("success", turn.success, done)
    yield from compared("reward", turn.reward, reward)
    yield from compared("object_id", turn.object_id, info["object_id"])
    yield from compared("fault", turn.fault, info["fault"])
    if turn.verb != ERROR:  # that feedback quotes what was said
        yield from compared("feedback", as_now(turn.feedback), writable(info["feedback"]))
