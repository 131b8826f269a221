"""How often an agent was where the thing lay that it did not find, and what would have shown it.

    python -m benchmarks.checks.out_of_sight RUN... [--steps 2]

It plays the failures of runs of ``er-gym bench`` again in which something that the task fetches or
looks for never came within the agent's reach. Where the agent had gone to its place (the object
that the key actions name), and had opened that if it must be opened, it tries what the agent could
do right then to bring the thing within reach: to close another drawer that covers it, or to go to
something that stands near it. The table says in how many of the failures one action does that, or
two; in how many of these one of them closes something; and in how many neither does, or the
episode was over. Tasks in one arrangement of a room may miss the same thing, and count each.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import click

from benchmarks.harness.output import progress
from benchmarks.monitor.world import CannotReplay, action_in, environment_of, task_of
from benchmarks.scoring.report import load_run
from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import names
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import RunDirectory, RunDirectoryError
from er_gym.tables import Table, as_markdown
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

LOOKS = {verbs.NAVIGATE, verbs.OPEN, verbs.CLOSE, verbs.OBSERVE, verbs.MOVE_FORWARD}
"""The verbs that may show something."""
_TRIED = sorted(
    (number for number, action in enumerate(ACTIONS) if action.verb in LOOKS),
    key=lambda number: ACTIONS[number].verb != verbs.CLOSE,  # so it is found if closing does it
)
NOT_THERE, NEVER, CLOSING = "not there", "more", "closing"


class Lost(NamedTuple):
    """A thing that never came within reach.

    Attributes:
        thing: its type.
        place: the object that it lay in or on.
        verb: what had to be done to the place to find it there: ``navigate to`` or ``open``.
    """

    thing: str
    place: str
    verb: str


def lost_thing(task: Task, record: EpisodeRecord) -> Lost | None:
    """The first thing that an episode did not find; None if it found all."""
    reached = {name for step in record.steps for name in step.interactable}
    place, verb = "", verbs.NAVIGATE
    for action in task.key_actions:
        if action.verb in (verbs.NAVIGATE, verbs.OPEN):
            place, verb = action.object_id, action.verb
        thing = action.actual_type if action.verb == verbs.PICKUP else ""
        if action.verb == verbs.END and task.type.search:
            thing = task.goal[0].object_type
        if thing and thing not in reached:
            return Lost(thing, place, verb)
    return None


def looked_at(lost: Lost, record: EpisodeRecord) -> int | None:
    """The step at which the agent had looked at the place; None if it never did."""
    for number, step in enumerate(record.steps):
        if step.success and (step.verb, step.object_id) == (lost.verb, lost.place):
            return number
    return None


def actions_to_see(env: EmbodiedEnv, thing: str, most: int) -> tuple[Action, ...]:
    """The fewest actions that bring a thing within reach from where an episode is; () if none were
    found.

    Args:
        env: its episode is lost.
        thing: a type.
        most: actions; more are not tried.
    """
    seen = set[object]()
    frontier: list[tuple[bytes, tuple[Action, ...]]] = [(env.snapshot(), ())]
    for _ in range(most):
        following = []
        for snapshot, path in frontier:
            legal = env.restore(snapshot)[1]["action_mask"]
            for action in (each for each in _TRIED if legal[each]):
                env.restore(snapshot)
                info = env.step(action)[4]
                longer = (*path, ACTIONS[action])
                if thing in names(info["interactable_mask"]):
                    return longer
                where = env.agent_pose, info["action_mask"].tobytes()
                if not info["end_reason"] and where not in seen:
                    seen.add(where)
                    following.append((env.snapshot(), longer))
        frontier = following
    return ()


def _outcome(env: EmbodiedEnv, task: Task, record: EpisodeRecord, most: int) -> list[str]:
    """What would have shown the thing that an episode did not find; [] if it found all."""
    lost = lost_thing(task, record)
    if lost is None:
        return []
    there = looked_at(lost, record)
    if there is None:
        return [NOT_THERE]
    info: Any = env.reset(seed=record.seed, options={"task": task})[1]
    for step in record.steps[1 : there + 1]:
        info = env.step(action_in(step.verb, step.object_type))[4]
        if bool(info["action_success"]) != step.success:
            raise click.ClickException(f"{record.task_id} comes out otherwise than it is recorded")
    path = () if info["end_reason"] else actions_to_see(env, lost.thing, most)
    closes = any(action.verb == verbs.CLOSE for action in path)
    return [str(len(path)) if path else NEVER, *([CLOSING] if closes else [])]


def _failures(path: Path) -> Iterator[EpisodeRecord]:
    run = load_run(path)
    for episode, score in zip(run.episodes, run.scores[CORRECTED.name], strict=True):
        if not score.success:
            yield episode


def _row(path: Path, most: int) -> tuple[str, ...]:
    failures = list(_failures(path))
    manifest = RunDirectory.open(path).manifest
    env, counts = environment_of(manifest), Counter[str]()
    for record in progress(failures, path.name, len(failures)):
        counts.update(_outcome(env, task_of(manifest, record), record, most))
    env.close()
    columns = [NOT_THERE, *map(str, range(1, most + 1)), CLOSING, NEVER]
    lost = counts.total() - counts[CLOSING]
    shown = [len(failures), lost, *(counts[name] for name in columns)]
    return path.name, *map(str, shown)


@click.command(help=__doc__)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--steps", default=2, show_default=True, type=click.IntRange(1, 3), help="Actions to try."
)
def main(runs: Sequence[Path], steps: int) -> None:
    try:
        rows = tuple(_row(run, steps) for run in runs)
    except (RunDirectoryError, CannotReplay) as error:
        raise click.ClickException(str(error)) from error
    actions = [f"{number} action{'s' * (number > 1)}" for number in range(1, steps + 1)]
    columns = ("Run", "Failures", "Not found", "Never looked there", *actions, "By closing", "More")
    click.echo(as_markdown([Table("What would have shown the thing", columns, rows, 1)]))


if __name__ == "__main__":
    main()
