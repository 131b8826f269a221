"""Play random actions for a long time in every scene, and check the invariants.

    python -m benchmarks.checks.soak [--scenes all|N] [--actions 2000] [--level env|engine]

``env`` plays random legal actions through the environment, and checks the invariants of
:mod:`benchmarks.checks.invariants` after each. ``engine`` sends random AI2-THOR actions, legal or
not, through the official client's interface, those of a normal program in
:mod:`benchmarks.checks.fuzz_requests`, and checks all that the fuzz checks. It ends with one line.
If something is broken, the exit code is 1 and the output has the command that repeats it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from random import Random

import click
import numpy as np

from benchmarks.checks.fuzz import ClientDriver, FuzzRun
from benchmarks.checks.fuzz_checks import floor_points
from benchmarks.checks.fuzz_requests import valid_request
from benchmarks.checks.invariants import Metadata, broken, stands_on_the_floor
from benchmarks.checks.scene_jobs import play_options, run_scene_jobs, with_bar
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import verbs
from er_gym.tasks.task import KeyAction, Task
from er_gym.tasks.types import TASK_TYPES
from er_gym.thor import SCENE_NAMES


@dataclass(frozen=True)
class SoakReport:
    """The result of a scene.

    Attributes:
        scene: its name.
        actions: how many actions were done.
        succeeded: how many of them succeeded.
        seconds: how long that took.
        problem: the first problem, which ends the scene's play; "" if there was none.
    """

    scene: str
    actions: int
    succeeded: int
    seconds: float
    problem: str = ""


Step = tuple[str, Metadata, list[str]]
"""An action, the metadata after it, and the problems."""


def free_play(scene: str) -> Task:
    """A task without a goal, so that an environment can be made in any scene."""
    return Task(
        id=f"soak-{scene}",
        type=TASK_TYPES[-1],
        scene=scene,
        instruction="Do as you like.",
        key_actions=(KeyAction(verbs.END),),
    )


def play_env(scene: str, seed: int) -> Iterator[Step]:
    """Random legal actions; a new episode whenever one is over."""
    random = np.random.default_rng([seed, SCENE_NAMES.index(scene)])
    env = EmbodiedEnv([free_play(scene)], obs_mode="state", instances="explore")
    try:
        _, info = env.reset(seed=seed)
        controller = env._controller  # the soak reads the environment's internals
        floor, over = floor_points(scene), False
        while True:
            if over:
                _, info = env.reset()
            action = int(random.choice(np.flatnonzero(info["action_mask"])))
            observation, reward, terminated, truncated, info = env.step(action)
            over = terminated or truncated
            problems = [] if env.observation_space.contains(observation) else ["bad observation"]
            if not np.isfinite(reward):
                problems.append(f"the reward is {reward}")
            metadata = controller.last_event.metadata
            problems += [*broken(metadata), *stands_on_the_floor(metadata, floor)]
            yield info["action"], metadata, problems
    finally:
        env.close()


def play_engine(scene: str, seed: int) -> Iterator[Step]:
    """Random AI2-THOR actions with valid parameters; the actions need not be legal."""
    random, game = Random(f"{seed} {scene}"), FuzzRun(ClientDriver)
    game.do({"action": "Reset", "sceneName": scene, "renderImage": False})
    while True:
        request = valid_request(game.room(random, [scene]))
        problems = game.do(request)
        yield str(request), game.metadata, problems


LEVELS: dict[str, Callable[[str, int], Iterator[Step]]] = {
    "env": play_env,
    "engine": play_engine,
}


def soak_scene(scene: str, *, level: str, actions: int, seed: int) -> SoakReport:
    """Play in one scene until all actions are done or there is a problem."""
    start = time.perf_counter()
    done = succeeded = 0
    problem = ""
    player = LEVELS[level](scene, seed)
    try:
        while done < actions and not problem:
            what, metadata, problems = next(player)
            done += 1
            succeeded += metadata["lastActionSuccess"]
            if problems:
                problem = f"after action {done}, {what}: {'; '.join(problems)}"
    except Exception as error:  # no exception may be raised
        problem = f"at action {done + 1}: {type(error).__name__}: {error}"
    finally:
        player.close()  # type: ignore[attr-defined]  # a generator, which an Iterator need not be
    return SoakReport(scene, done, succeeded, time.perf_counter() - start, problem)


def _player(level: str, actions: int, seed: int) -> Callable[[str], SoakReport]:
    return partial(soak_scene, level=level, actions=actions, seed=seed)


def soak(
    scenes: Sequence[str], *, level: str, actions: int, seed: int, workers: int
) -> Iterator[SoakReport]:
    """Play in all scenes in ``workers`` processes (1: in this process)."""

    def lost(scene: str, died: str) -> SoakReport:
        return SoakReport(scene, 0, 0, 0.0, died)

    return run_scene_jobs(partial(_player, level, actions, seed), scenes, workers, lost)


@click.command()
@play_options(actions=2000)
@click.option("--level", default="env", show_default=True, type=click.Choice(list(LEVELS)))
def main(scenes: list[str], actions: int, seed: int, workers: int, level: str) -> None:
    """Play random actions in the scenes and check the invariants."""
    reports: list[SoakReport] = []
    start = time.perf_counter()

    def status() -> str:
        speed = sum(r.actions for r in reports) / (time.perf_counter() - start)
        bad = sum(bool(r.problem) for r in reports)
        return f"{speed:.0f} actions/s, {bad} scenes with problems"

    played = soak(scenes, level=level, actions=actions, seed=seed, workers=workers)
    for report in with_bar(f"soak, {level}", len(scenes), played, status):
        reports.append(report)
    raise SystemExit(verdict(reports, level=level, actions=actions, seed=seed))


def verdict(reports: Sequence[SoakReport], *, level: str, actions: int, seed: int) -> int:
    """Print a line for each scene with a problem, then a summary in one line."""
    bad = sorted((r for r in reports if r.problem), key=lambda r: SCENE_NAMES.index(r.scene))
    for report in bad:
        click.echo(
            f"{report.scene} {report.problem}\n  again: python -m benchmarks.checks.soak --level "
            f"{level} --seed {seed} --actions {actions} --scenes {report.scene} --workers 1",
            err=True,
        )
    done, good = (sum(getattr(r, name) for r in reports) for name in ("actions", "succeeded"))
    click.echo(
        f"{'BROKEN' if bad else 'ok'}: {len(reports)} scenes, {done} {level} actions "
        f"({100 * good / max(done, 1):.0f} % succeeded), seed {seed}, "
        f"{len(bad)} scenes with problems"
    )
    return 1 if bad else 0


if __name__ == "__main__":
    main()
