"""Play random actions, valid and absurd, and look for faults of the engine.

    python -m benchmarks.checks.fuzz --actions 100000 --seed 0 [--workers 2] [--scenes all|N|names]
    python -m benchmarks.checks.fuzz --actions 100000 --seed 0 --run 17    # one run, step by step
    python -m benchmarks.checks.fuzz --actions 10000 --agents 4            # up to four in a room

The actions are split into runs of 200 in a scene each; one in four begins in a generated house. A
run depends only on its number and the seed, so the same seed plays the same actions with any number
of workers. The ``fingerprint`` at the end is a digest of all requests and answers; equal ones prove
it. One run in ten uses the official client's interface, the others use the engine directly.
:mod:`benchmarks.checks.fuzz_checks` checks the state after each action. Each problem is printed
with the command that repeats it, and makes the exit code 1.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from random import Random
from traceback import extract_tb
from typing import Any

import click

from benchmarks.checks.fuzz_checks import CompanyChecker, Pictures, floor, scene_of
from benchmarks.checks.fuzz_report import FuzzPlan, FuzzReport, FuzzStep, show
from benchmarks.checks.fuzz_requests import Request, Room, draw_house, draw_request
from benchmarks.checks.scene_jobs import play_options, run_scene_jobs, with_bar
from benchmarks.terminal import echo
from er_gym.sim.controller import EmbeddedController
from er_gym.sim.crew import MOST_AGENTS
from er_gym.sim.engine import Engine
from er_gym.sim.errors import CLIENT_ERRORS
from er_gym.sim.render.view import View
from er_gym.sim.world import World

_THROUGH_THE_CLIENT = 10
"""One run in this many uses the official client's interface."""
_WIDTH, _HEIGHT = 32, 24
_HOUSES = 0.25
"""The share of runs that begin in a generated house."""
_INTERRUPTED = 130


@dataclass
class Outcome:
    """The answer: plain metadata, the pictures, the problems of the call itself, and what the
    agents are told that did not act."""

    metadata: dict[str, Any]
    pictures: Pictures
    problems: list[str] = field(default_factory=list)
    others: list[Outcome] = field(default_factory=list)


class EngineDriver:
    """Plays the engine itself, which never raises."""

    def __init__(self) -> None:
        self._engine = Engine(_WIDTH, _HEIGHT)

    @property
    def world(self) -> World:
        return self._engine.world

    def step(self, request: Request) -> Outcome:
        """Do an action."""
        outcome = _outcome(*self._engine.step(request))
        outcome.others = [_outcome(each.metadata, each.view) for each in self._engine.bystanders]
        return outcome


def _outcome(metadata: Mapping[str, Any], view: View | None) -> Outcome:
    views = () if view is None else (view, *view.third_party)
    drawn = [p for v in views for p in (v.rgb, v.depth, v.instances, v.classes)]
    return Outcome(dict(metadata), [picture for picture in drawn if picture is not None])


class ClientDriver:
    """Plays through the official client's interface, and raises where the official client does."""

    def __init__(self) -> None:
        self._controller = EmbeddedController(width=_WIDTH, height=_HEIGHT)

    @property
    def world(self) -> World:
        assert self._controller.server is not None
        return self._controller.server.engine.world  # the fuzz reads the engine behind the client

    def step(self, request: Request) -> Outcome:
        """Do an action, and check that only failed actions raise, and the right error."""
        raised: Exception | None = None
        try:
            self._controller.step(request, raise_for_failure=True)
        except (ValueError, RuntimeError) as error:
            if self._controller.last_event is None:
                raise  # not the client's doing
            raised = error
        event: Any = self._controller.last_event
        metadata = dict(event.metadata)
        wrong_call = metadata["errorCode"] in CLIENT_ERRORS
        due = None if metadata["lastActionSuccess"] else ValueError if wrong_call else RuntimeError
        problems = []
        if (type(raised) if raised else None) is not due or (
            raised and str(raised) != metadata["errorMessage"]
        ):
            problems.append(f"raised {raised!r}, not {due}, at {metadata['errorMessage']!r}")
        acting, *others = sorted(
            map(_told, event.events),
            key=lambda each: each.metadata["agentId"] != metadata["agentId"],
        )
        return replace(acting, problems=problems, others=others)


def _told(event: Any) -> Outcome:
    # Not the depth, which the client squeezes: a picture a pixel high has no height.
    drawn = (event.frame, event.instance_segmentation_frame)
    return Outcome(dict(event.metadata), [picture for picture in drawn if picture is not None])


class FuzzRun:
    """A game in a scene: the player, the checker, and what they know of the scene."""

    def __init__(self, by: type[EngineDriver] | type[ClientDriver], agents: int = 1) -> None:
        self._player = by()
        self._checker = CompanyChecker()
        self._agents, self._there = agents, 1
        self._ids: dict[str, None] = {}
        self.metadata: dict[str, Any] = {}
        self.seconds = 0.0

    def do(self, request: Request) -> list[str]:
        """Do an action; returns the problems after it."""
        start = time.perf_counter()
        answer = self._player.step(request)
        self.seconds = time.perf_counter() - start
        self.metadata = answer.metadata
        self._ids.update(dict.fromkeys(entry["objectId"] for entry in self.metadata["objects"]))
        told = [(each.metadata, each.pictures) for each in (answer, *answer.others)]
        self._there = len(told)
        return [*answer.problems, *self._checker.sees(request, told, self._player.world)]

    def room(self, random: Random, scenes: Sequence[str]) -> Room:
        """The knowledge from which the next request is drawn."""
        there = {entry["objectId"] for entry in self.metadata["objects"]}
        gone = [object_id for object_id in self._ids if object_id not in there]
        places = floor(self._player.world.scene.name, 0.25)
        return Room(random, scenes, self.metadata, places, gone, self._agents, self._there)


def play(plan: FuzzPlan, run: int) -> Iterator[FuzzStep]:
    """The steps of a run. After an exception, a new game begins."""
    random = Random(f"{plan.seed} {run}")
    scene = random.choice(plan.scenes)
    by = ClientDriver if run % _THROUGH_THE_CLIENT == _THROUGH_THE_CLIENT - 1 else EngineDriver
    game: FuzzRun | None = None
    for number in range(plan.steps(run)):
        request: Request = {"action": "Reset", "sceneName": scene, "renderImage": False}
        problems, seconds = [], 0.0
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            try:
                if game is None:
                    game = FuzzRun(by, plan.agents)
                    problems += game.do(request)
                    if plan.agents > 1:
                        count = 1 + random.randrange(plan.agents)
                        problems += game.do({"action": "Initialize", "agentCount": count})
                    if random.random() < _HOUSES:
                        house = draw_house(game.room(random, plan.scenes))
                        problems += game.do({"action": "CreateHouse", "house": house})
                scene = scene_of(game.metadata)
                request = draw_request(game.room(random, plan.scenes))
                problems += game.do(request)
                error, seconds = game.metadata["errorMessage"], game.seconds
            except Exception as failure:  # no exception may be raised
                error, game = f"{type(failure).__name__}: {failure}", None
                problems.append(f"raised at {_place(failure)}: {error}")
        problems += [f"warned at {Path(w.filename).name}:{w.lineno}: {w.message}" for w in warned]
        yield FuzzStep(run, number, scene, request, error, problems, seconds)


def _place(error: Exception) -> str:
    """The place of an exception: the last of er-gym's own lines."""
    calls = extract_tb(error.__traceback__)
    ours = [call for call in calls if "er_gym" in call.filename] or calls
    return f"{Path(ours[-1].filename).name}:{ours[-1].lineno}"


def play_run(run: int, *, plan: FuzzPlan) -> FuzzReport:
    """A whole run, counted."""
    report = FuzzReport()
    for step in play(plan, run):
        report.count(step)
    return report


def _player(plan: FuzzPlan) -> Callable[[int], FuzzReport]:
    return partial(play_run, plan=plan)


def fuzz(plan: FuzzPlan, workers: int) -> Iterator[FuzzReport]:
    """The report of every run, as it ends, from ``workers`` processes (1: this process)."""

    def lost(run: int, died: str) -> FuzzReport:
        return FuzzReport(wrong=[FuzzStep(run, 0, "?", {}, "", [died], 0.0)])

    return run_scene_jobs(partial(_player, plan), range(plan.runs), workers, lost)


@click.command()
@play_options(actions=10_000)
@click.option(
    "--agents",
    default=1,
    show_default=True,
    type=click.IntRange(1, MOST_AGENTS),
    help="The most agents in a room.",
)
@click.option("--run", type=click.IntRange(0), help="Play only this run, and print every step.")
def main(
    scenes: list[str], actions: int, seed: int, workers: int, agents: int, run: int | None
) -> None:
    """Play random actions, valid and absurd, and check the invariants."""
    plan = FuzzPlan(seed, actions, tuple(scenes), agents)
    total, start, code = FuzzReport(), time.perf_counter(), 0
    if run is not None:
        if run >= plan.runs:
            raise click.UsageError(f"--run must be from 0 to {plan.runs - 1}, not {run}")
        for step in play(plan, run):
            total.count(step)
            echo(step)
    else:

        def status() -> str:
            speed = total.total.tries / (time.perf_counter() - start)
            return f"{speed:.0f} actions/s, {len(total.wrong)} with problems"

        try:
            for report in with_bar("fuzz", plan.runs, fuzz(plan, workers), status):
                total.add(report)
        except KeyboardInterrupt:
            echo("interrupted; so far:")
            code = _INTERRUPTED
    raise SystemExit(show(total, plan, time.perf_counter() - start) or code)


if __name__ == "__main__":
    main()
