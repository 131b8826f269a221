"""Checks that the corrected scorer judges episodes, from their records, as the environment did
live.

    python -m benchmarks.checks.one_judge [--suite er-1k] [--per-type N] [--protocol paper]

Several players play every task of a suite (see ``PLAYERS``). Each episode's record goes through its
JSON and is then judged again. Success, the key actions left and the rewards must be the same.

Prints how many episodes each player played, how many succeeded according to each judge, and every
disagreement; the exit code is 1 if there is one.
"""

from __future__ import annotations

import random
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import click

from agents import make_agent
from benchmarks.harness.output import print_table, progress
from benchmarks.harness.samples import sample_of_types
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import action_of
from er_gym.envs.protocol import PROTOCOLS
from er_gym.envs.solver import Solver
from er_gym.rollout.agent import Agent, Decision
from er_gym.rollout.judgement import judged
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.judge import Criteria, Progress
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import KeyAction, Task

_UNDOING = frozenset({verbs.PUT, verbs.PICKUP, verbs.TOGGLE})
_CARELESS = 0.25
"""The probability that the careless oracle does a random legal action, possibly ``end``."""


def shuffled(keys: Sequence[KeyAction], draw: random.Random) -> tuple[KeyAction, ...]:
    """Key actions with their transfers in another order: the last two swapped, or all shuffled.

    A single transfer stays.
    """
    parts: list[list[KeyAction]] = [[]]
    for key in keys:
        if key.verb in (verbs.NAVIGATE, verbs.END) and any(
            earlier.verb in (verbs.PUT, verbs.TOGGLE, verbs.SLICE) for earlier in parts[-1]
        ):
            parts.append([])
        parts[-1].append(key)
    *parts, ends = parts if parts[-1][0].verb == verbs.END else (*parts, [])
    before = list(parts)
    draw.shuffle(parts)
    if len(parts) > 1 and parts == before:
        parts.append(parts.pop(-2))
    return tuple(key for part in (*parts, ends) for key in part)


def by_the_whole(action: Action, info: Mapping[str, Any]) -> Action:
    """``put in Sink`` for ``put in SinkBasin`` where that is legal; other actions unchanged."""
    for whole, basin in BASIN_OF.items():
        named = Action(action.verb, whole)
        if action == Action(verbs.PUT, basin) and named in info["legal"]:
            return named
    return action


class _SeededOracle:
    """An oracle that makes random choices.

    Args:
        seed: of these choices.
    """

    obs_mode = "text"

    def __init__(self, seed: int = 0) -> None:
        self._draw = random.Random(seed)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._solver = Solver()


class ShuffledOracle(_SeededOracle):
    """Does the key actions with the transfers in another order, and names Sink for SinkBasin."""

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Choose an order."""
        super().reset(task, obs, info)
        self._progress = Progress.start(Criteria(shuffled(task.key_actions, self._draw)))

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The next step in that order."""
        action = action_of(info)
        if action is not None and info["action_success"]:
            self._progress, _ = self._progress.after(
                action.verb, action.object_type, info["object_id"]
            )
        to_come = {
            "keys_left": self._progress.left,
            "keys_done": self._progress.done,
        }
        return Decision(by_the_whole(self._solver.next({**info, **to_come})[0], info))


class CarelessOracle(_SeededOracle):
    """Does the key actions, and sometimes a random legal action."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The solver's next step, or a random action."""
        if self._draw.random() < _CARELESS:
            return Decision(self._draw.choice(info["legal"]))
        return Decision(self._solver.next(info)[0])


class UndoingOracle(_SeededOracle):
    """Does the key actions, then one more action, then says ``end``.

    That action can undo the goal: it puts down an object, or switches one off.
    """

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        super().reset(task, obs, info)
        self._undone = False

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The solver's next step; before ``end``, one of :data:`_UNDOING`."""
        action, _ = self._solver.next(info)
        undoing = [legal for legal in info["legal"] if legal.verb in _UNDOING]
        if action.verb == verbs.END and undoing and not self._undone:
            self._undone = True
            action = self._draw.choice(undoing)
        return Decision(action)


PLAYERS: dict[str, Callable[[int], Agent]] = {
    "oracle": lambda seed: make_agent("oracle", seed),
    "searcher": lambda seed: make_agent("searcher", seed),
    "random": lambda seed: make_agent("random", seed),
    "shuffled oracle": ShuffledOracle,
    "careless oracle": CarelessOracle,
    "undoing oracle": UndoingOracle,
}
"""By name: how to make the player, given a seed."""


@dataclass(frozen=True)
class Judged:
    """An episode, judged twice.

    Attributes:
        player: one of :data:`PLAYERS`.
        record: read back from its JSON.
        apart: the disagreements of the environment and the corrected scorer, in words.
    """

    player: str
    record: EpisodeRecord
    apart: tuple[str, ...]


def judge_twice(env: EmbodiedEnv, task: Task, player: str, seed: int = 0) -> Judged:
    """Play an episode, and judge its record.

    Args:
        env: with no step penalties.
        player: one of :data:`PLAYERS`.
        seed: of the run.
    """
    number = episode_seed(seed, task.id)
    played = play_episode(env, PLAYERS[player](number), task, number)
    if played.error:
        raise RuntimeError(f"{player} in {task.id}: {played.error}")
    record = EpisodeRecord.model_validate_json(played.model_dump_json())
    progress, score = judged(record), score_episode(record, CORRECTED)

    def names(keys: Sequence[KeyAction]) -> list[str]:
        return [f"{key.verb} {key.object_id}".rstrip() for key in keys]

    said = {
        "success": (record.success, score.success),
        "left": (names(env.details["keys_left"]), names(progress.left)),
        "done": (names(env.details["keys_done"]), names(progress.done)),
        "reward": (record.total_reward, sum(key.reward for key in progress.done)),
        "missing": (
            sum(key.scored for key in env.details["keys_left"]),
            len(score.missing),
        ),
    }
    apart = tuple(
        f"{name}: {live!r} live, {again!r} from the record"
        for name, (live, again) in said.items()
        if live != again
    )
    return Judged(player, record, apart)


def judge_all(tasks: Sequence[Task], protocol: str = "default", seed: int = 0) -> Iterator[Judged]:
    """Every task, played by every player."""
    env = EmbodiedEnv([], obs_mode="text", protocol=protocol)
    try:
        for task in tasks:
            for player in PLAYERS:
                yield judge_twice(env, task, player, seed)
    finally:
        env.close()


@click.command()
@click.option("--suite", default="er-1k", show_default=True)
@click.option("--per-type", type=click.IntRange(1), help="Only this many tasks of each type.")
@click.option("--protocol", default="default", type=click.Choice(list(PROTOCOLS)))
@click.option("--seed", default=0, show_default=True)
def main(suite: str, per_type: int | None, protocol: str, seed: int) -> None:
    """Play every task of a suite with every player, and judge each episode twice."""
    tasks: Sequence[Task] = load_suite(suite).tasks
    if per_type is not None:
        tasks = sample_of_types(tasks, (), per_type, f" {seed}")
    counts: dict[str, Counter[str]] = {player: Counter() for player in PLAYERS}
    episodes = judge_all(tasks, protocol, seed)
    for found in progress(episodes, "Judging", len(tasks) * len(PLAYERS)):
        count, record = counts[found.player], found.record
        count["episodes"] += 1
        count["ended by end"] += record.end_reason == "end"
        count["env: success"] += record.success
        count["scorer: success"] += score_episode(record, CORRECTED).success
        count["apart"] += bool(found.apart)
        for what in found.apart:
            click.echo(f"{record.task_id}, {found.player}: {what}")
    columns = ("episodes", "ended by end", "env: success", "scorer: success", "apart")
    print_table(
        f"{suite}, protocol {protocol}",
        ("player", *columns),
        ((player, *map(count.__getitem__, columns)) for player, count in counts.items()),
    )
    sys.exit(int(any(count["apart"] for count in counts.values())))


if __name__ == "__main__":
    main()
