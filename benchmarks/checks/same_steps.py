"""Checks that another commit plays the same steps: to the byte, whatever became faster.

    python -m benchmarks.checks.same_steps --write FILE [--share 1.0]
    python -m benchmarks.checks.same_steps --against FILE

The first call, in a checkout of the one commit, plays episodes of every type of task in several
suites, with every kind of observation, both protocols, both ways to choose instances, and faults in
some (``CASES``). It writes a digest of each episode: observations, masks and all of ``info``,
feedback, rewards, ends, the details, and AI2-THOR's metadata of all objects at the end. The second
call, in the other, plays the same and names each episode that came out otherwise; the exit code is
1 if one did. A share below 1 plays as much of each case.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from inspect import signature
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.harness.output import FORMAT, Output, progress, write_figures
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks.types import TASK_TYPES

_STRAY = 0.05
"""The share of the actions that are drawn from all, legal or not."""
_RARE_END = 0.8
"""The share of the drawn ``end`` that are drawn again: most episodes would be short."""
_BABBLE = 0.01
"""The share of the replies that name no action."""
# Flat light, the only one that older commits have.
_SMALL = {"width": 64, "height": 48} | (
    {"light": "flat"} if "light" in signature(EmbodiedEnv).parameters else {}
)


@dataclass(frozen=True)
class Case:
    """A kind of play.

    Attributes:
        name: of the case. suite: where tasks are drawn from.
        steps: how many are played at least, over all types of tasks.
        solved: the share of the actions that a solver chooses; the others are random legal ones.
        arguments: of the environment.
    """

    name: str
    suite: str
    steps: int
    solved: float = 0.4
    arguments: Mapping[str, Any] = field(default_factory=dict)


CASES = (
    Case("mini", "mini", 2000, 0.0, {"obs_mode": "state"}),
    Case("mini solved", "mini", 1500, 0.6, {"obs_mode": "state+text"}),
    Case("train", "train", 3000, 0.3, {"obs_mode": "state"}),
    Case("er-1k", "er-1k", 1500, 0.3, {"obs_mode": "text+objects"}),
    Case("explore", "train", 1000, 0.4, {"obs_mode": "state", "instances": "explore"}),
    Case("faults", "train", 1000, 0.4, {"obs_mode": "state+text", "faults": 0.2}),
    Case("near", "mini", 500, 0.4, {"obs_mode": "state", "visibility_distance": 1.5}),
    Case("coarse", "mini", 500, 0.4, {"obs_mode": "state", "grid_size": 0.25}),
    Case("paper", "er-1k", 1000, 0.4, {"obs_mode": "state+text", "protocol": "paper"}),
    Case("pictures", "mini", 400, 0.4, {"obs_mode": "rgb+depth+instance+state", **_SMALL}),
    Case("marks", "train", 150, 0.4, {"obs_mode": "rgb+objects", "annotate": True, **_SMALL}),
)


class Digest:
    """A digest of values one after another: plain data, arrays, and er-gym's own objects."""

    def __init__(self) -> None:
        self._hash = blake2b(digest_size=12)

    def add(self, value: Any) -> None:
        """Add a value; mappings in their order."""
        if isinstance(value, np.ndarray):
            self._say(f"{value.dtype}{value.shape}")
            self._hash.update(np.ascontiguousarray(value).tobytes())
        elif isinstance(value, Mapping):
            for name, entry in value.items():
                self._say(str(name))
                self.add(entry)
        elif isinstance(value, (list, tuple)):
            self._say(f"{len(value)} of")
            for entry in value:
                self.add(entry)
        else:
            self._say(f"{type(value).__name__} {value!r}")

    def _say(self, text: str) -> None:
        self._hash.update(text.encode() + b"\0")

    def text(self) -> str:
        """The digest of all that was added."""
        return self._hash.hexdigest()


@dataclass(frozen=True)
class Played:
    """An episode: its number of steps, and the digest of all that was returned."""

    steps: int
    digest: str


def play(env: EmbodiedEnv, case: Case, seed: int) -> Played:
    """An episode with this seed."""
    random, digest = np.random.default_rng([39, seed]), Digest()
    obs, info = env.reset(seed=seed)
    digest.add((obs, info))
    solver, steps, over = Solver(), 0, False
    while not over:
        action = choose(env, case, solver, random, info)
        obs, reward, ended, cut, info = env.step(action)
        digest.add((str(action), obs, reward, ended, cut, info, env.details, vars(env.agent_pose)))
        steps, over = steps + 1, ended or cut
    # An entry's keys come in the order in which they were first read, if anything read them.
    digest.add([dict(sorted(entry.items())) for entry in env.objects])
    return Played(steps, digest.text())


def choose(
    env: EmbodiedEnv, case: Case, solver: Solver, random: np.random.Generator, info: dict[str, Any]
) -> Any:
    draw = random.random()
    if draw < _BABBLE:
        return "think about it"
    if draw < _BABBLE + _STRAY:
        return int(random.integers(len(ACTIONS)))
    # The solver reads names of types that only the default protocol has.
    if draw < _BABBLE + _STRAY + case.solved and case.arguments.get("protocol") != "paper":
        return solver.next(with_details(env, info))[0]
    legal = np.flatnonzero(info["action_mask"])
    action = int(random.choice(legal))
    if ACTIONS[action].verb == "end" and random.random() < _RARE_END:
        action = int(random.choice(legal))
    return action


def played(cases: tuple[Case, ...], share: float) -> Iterator[tuple[str, Played]]:
    """The episodes of some cases by name."""
    for case in cases:
        for number, kind in enumerate(TASK_TYPES):
            env = EmbodiedEnv(case.suite, task_type=kind.name, **case.arguments)
            wanted, steps, seed = share * case.steps / len(TASK_TYPES), 0, 1000 * number
            while steps < wanted:
                episode = play(env, case, seed)
                yield f"{case.name}, {kind.name}, seed {seed}", episode
                steps, seed = steps + episode.steps, seed + 1
            env.close()


def differences(found: Mapping[str, Any], told: Mapping[str, Any]) -> list[str]:
    """The names of the episodes that differ, or that only one side has."""
    return [name for name in {**told, **found} if found.get(name) != told.get(name)]


@click.command()
@click.option("--write", type=Output(), help="Write the digests to this file.")
@click.option("--against", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--share", default=1.0, show_default=True, type=click.FloatRange(0, min_open=True))
def main(write: Path | None, against: Path | None, share: float) -> None:
    """Play, and write the digests of the episodes or compare them."""
    told: dict[str, Any] | None = None
    if against is not None:
        figures = json.loads(against.read_text(encoding="utf-8"))
        if figures.get("format") != FORMAT:
            raise click.UsageError(f"{against} is no file of --write")
        told, share = figures["figures"]["episodes"], figures["figures"]["share"]
    found = {name: vars(episode) for name, episode in progress(played(CASES, share), "episodes")}
    steps = sum(episode["steps"] for episode in found.values())
    click.echo(f"{steps} steps in {len(found)} episodes")
    write_figures(write, {"share": share, "episodes": found})
    if told is not None:
        apart = differences(found, told)
        for name in apart:
            click.echo(f"{name}: {found.get(name)}, not {told.get(name)}")
        click.echo(f"{len(apart)} of {len(found)} episodes differ from {against}")
        sys.exit(1 if apart else 0)


if __name__ == "__main__":
    main()
