"""Play random actions for a long time in every scene, and check the invariants.

    python -m benchmarks.checks.soak [--scenes all|N] [--actions 2000] [--level env|engine]

``env`` plays random legal actions through the environment; ``engine`` sends random AI2-THOR
actions, legal or not, to the controller. After each step the invariants of
:mod:`benchmarks.checks.invariants` are checked. It ends with one line. If an invariant is broken,
the exit code is 1 and the output has the command that repeats it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import click
import numpy as np
from rich.console import Console

from benchmarks.checks.invariants import (
    Metadata,
    a_refusal_changed_nothing,
    broken,
    stands_on_the_floor,
)
from benchmarks.checks.scene_jobs import choose_scenes, run_scene_jobs
from benchmarks.cli.progress import bar
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.worker_pool import LostJob
from er_gym.sim.space.walkable_floor import standing_places
from er_gym.tasks import verbs
from er_gym.tasks.task import KeyAction, Task
from er_gym.tasks.types import TASK_TYPES
from er_gym.thor import SCENE_NAMES, make_controller

_FLOOR_STEP = 0.05
_ANY_OBJECT = 0.2
"""The probability that an object is drawn from all, not only from those that suit the action."""


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
"""An action, the metadata after it, and problems besides the invariants."""


def _random(scene: str, seed: int) -> np.random.Generator:
    return np.random.default_rng([seed, SCENE_NAMES.index(scene)])


def _floor(controller: Any) -> np.ndarray:
    """(P, 2) x and z where the agent can stand, metres."""
    scene = controller.last_event.metadata["sceneName"].removesuffix("_physics")
    return standing_places(scene, _FLOOR_STEP)


# -- through the environment -----------------------------------------------------------------------


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
    random = _random(scene, seed)
    env = EmbodiedEnv([free_play(scene)], obs_mode="state", instances="explore")
    try:
        _, info = env.reset(seed=seed)
        controller = env._controller  # the soak reads the environment's internals
        floor, over = _floor(controller), False
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
            problems.extend(stands_on_the_floor(metadata, floor))
            yield info["action"], metadata, problems
    finally:
        env.close()


# -- through the controller ------------------------------------------------------------------------

Parameters = Callable[[np.random.Generator, Metadata, Sequence[dict[str, float]]], dict[str, Any]]


def _nothing(random: np.random.Generator, metadata: Metadata, positions: Any) -> dict[str, Any]:
    return {}


def _one_of(name: str, values: Sequence[float | None]) -> Parameters:
    def draw(random: np.random.Generator, metadata: Metadata, positions: Any) -> dict[str, Any]:
        value = values[int(random.integers(len(values)))]
        return {} if value is None else {name: value}

    return draw


def _object(prop: str, **more: Sequence[Any]) -> Parameters:
    """An object, usually one with a property; sometimes with force."""

    def draw(random: np.random.Generator, metadata: Metadata, positions: Any) -> dict[str, Any]:
        objects = metadata["objects"]
        suited = [entry for entry in objects if prop == "" or entry[prop]] or objects
        seen = [entry for entry in suited if entry["visible"]]
        pool = objects if random.random() < _ANY_OBJECT else (seen or suited)
        chosen = {"objectId": pool[int(random.integers(len(pool)))]["objectId"]}
        extra = {name: values[int(random.integers(len(values)))] for name, values in more.items()}
        return {**chosen, **extra}

    return draw


def _anywhere(
    random: np.random.Generator, metadata: Metadata, positions: Sequence[dict[str, float]]
) -> dict[str, Any]:
    """A pose on the floor or near it."""
    position = dict(positions[int(random.integers(len(positions)))])
    if random.random() < _ANY_OBJECT:
        position["x"] += float(random.normal())
    return {
        "position": position,
        "rotation": float(random.integers(24)) * 15.0,
        "horizon": float(random.choice([-30, 0, 30, 60])),
        "standing": bool(random.random() < 0.8),
    }


_FORCE = {"forceAction": (False, True)}
_STEPS = _one_of("moveMagnitude", (None, 0.0, 0.1, 0.25, 0.5, 1.0, 5.0))
_TURNS = _one_of("degrees", (None, 0.0, 30.0, 45.0, 90.0, -90.0, 360.0))
_TILTS = _one_of("degrees", (None, 1.0, 15.0, 30.0, 88.0))

REPERTOIRE: dict[str, Parameters] = {
    "Pass": _nothing,
    "Done": _nothing,
    "Stand": _nothing,
    "Crouch": _nothing,
    "MoveAhead": _STEPS,
    "MoveBack": _STEPS,
    "MoveLeft": _STEPS,
    "MoveRight": _STEPS,
    "RotateLeft": _TURNS,
    "RotateRight": _TURNS,
    "LookUp": _TILTS,
    "LookDown": _TILTS,
    "Teleport": _anywhere,
    "TeleportFull": _anywhere,
    "GetReachablePositions": _one_of("gridSize", (None, 0.25, 0.5)),
    "GetInteractablePoses": _object("", maxPoses=(1, 10)),
    "PickupObject": _object("pickupable", **_FORCE),
    "PutObject": _object("receptacle", **_FORCE),
    "DropHandObject": _nothing,
    "OpenObject": _object("openable", openness=(0.2, 1.0), **_FORCE),
    "CloseObject": _object("openable", **_FORCE),
    "ToggleObjectOn": _object("toggleable", **_FORCE),
    "ToggleObjectOff": _object("toggleable", **_FORCE),
    "SliceObject": _object("sliceable", **_FORCE),
    "CookObject": _object("cookable", **_FORCE),
    "DirtyObject": _object("dirtyable", **_FORCE),
    "CleanObject": _object("dirtyable", **_FORCE),
    "FillObjectWithLiquid": _object(
        "canFillWithLiquid", fillLiquid=("water", "coffee", "wine"), **_FORCE
    ),
    "EmptyLiquidFromObject": _object("canFillWithLiquid", **_FORCE),
    "BreakObject": _object("breakable", **_FORCE),
    "UseUpObject": _object("pickupable", **_FORCE),
}
"""How each action's parameters are drawn."""

_OFTEN = ("PickupObject", "PutObject", "OpenObject", "TeleportFull")
"""Without these actions most of the others would be refused."""


def play_engine(scene: str, seed: int) -> Iterator[Step]:
    """Random AI2-THOR actions with valid parameters; the actions need not be legal."""
    random = _random(scene, seed)
    names = [*REPERTOIRE, *3 * _OFTEN]
    controller = make_controller(scene=scene, headless=True, snapToGrid=False, gridSize=0.25)
    try:
        floor = _floor(controller)
        positions = controller.step(action="GetReachablePositions").metadata["actionReturn"]
        before = controller.last_event.metadata
        while True:
            name = names[int(random.integers(len(names)))]
            arguments = REPERTOIRE[name](random, before, positions)
            after = controller.step(action=name, **arguments).metadata
            problems = list(stands_on_the_floor(after, floor))
            problems.extend(a_refusal_changed_nothing(before, after))
            yield f"{name} {arguments}", after, problems
            before = after
    finally:
        controller.stop()


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
            problems = [*broken(metadata), *problems]
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
    for scene, report in run_scene_jobs(partial(_player, level, actions, seed), scenes, workers):
        if isinstance(report, LostJob):
            report = SoakReport(scene, 0, 0, 0.0, f"the process died, exit code {report.exitcode}")
        yield report


@click.command()
@click.option("--scenes", default="all", show_default=True, help="all, how many, or names.")
@click.option("--actions", default=2000, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=0, show_default=True, type=click.IntRange(0))
@click.option("--workers", default=2, show_default=True, type=click.IntRange(1))
@click.option("--level", default="env", show_default=True, type=click.Choice(list(LEVELS)))
def main(scenes: str, actions: int, seed: int, workers: int, level: str) -> None:
    """Play random actions in the scenes and check the invariants."""
    try:
        chosen = choose_scenes(scenes)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    console = Console(stderr=True)
    reports: list[SoakReport] = []
    start = time.perf_counter()
    with bar(console) as progress:
        task = progress.add_task(f"soak, {level}", total=len(chosen), status="starting")
        for report in soak(chosen, level=level, actions=actions, seed=seed, workers=workers):
            reports.append(report)
            speed = sum(r.actions for r in reports) / (time.perf_counter() - start)
            bad = sum(bool(r.problem) for r in reports)
            progress.update(
                task, advance=1, status=f"{speed:.0f} actions/s, {bad} scenes with problems"
            )
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
    sys.exit(main())
