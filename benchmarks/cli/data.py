"""``er-gym data``: count, verify, look at, export and import trajectories; draw frames."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.data_critic import CriticOptions, read_thoughts, refuse_without_critic
from benchmarks.cli.data_export import export
from benchmarks.cli.data_frames import frames
from benchmarks.cli.data_import import import_
from benchmarks.cli.errors import CRASHED, BadInput, bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions, processors, with_executor_options
from benchmarks.cli.options import EXISTING_FILE, FILE, FOLDER, force_option, with_options
from benchmarks.cli.suites import suite_given
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.terminal import echo, stdout, terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from er_gym.data.collection import Collection
    from er_gym.data.reenactment import Reenact
    from er_gym.data.trajectory import Trajectory
    from er_gym.tasks.task import Task

FORMATS = ("table", "md", "json")
_MOST_LINES = 20
"""How many differences are printed."""
_CLOSE = 3
"""How many ids like a mistyped one are named."""
_collection = click.argument("collection", metavar="DIR", type=FOLDER)


@click.group()
def data() -> None:
    """Trajectories that er-gym collect has written: count, verify, show, export; and frames."""


data.add_command(export)
data.add_command(frames)
data.add_command(import_)


@data.command()
@_collection
@click.option("--format", "layout", type=click.Choice(FORMATS), default="table", show_default=True)
@click.option("--plots", type=FOLDER, help="Draw the charts into this folder, as PNG.")
@force_option
def stats(collection: Path, layout: str, plots: Path | None, force: bool) -> None:
    """Count trajectories, thoughts and transitions, beside the paper's figures."""
    import json

    from benchmarks.scoring.data_tables import statistics_tables
    from benchmarks.scoring.tables import print_tables
    from er_gym.data.statistics import statistics
    from er_gym.tables import as_markdown

    with bad_input(ImportError):
        found = statistics(_opened(collection))
        if not found.trajectories:
            raise BadInput(f"{collection} holds no trajectory yet; run er-gym collect again")
        if layout == "json":
            echo(json.dumps(found.as_dict(), indent=1, ensure_ascii=False))
        elif layout == "md":
            echo(as_markdown(statistics_tables(found)), nl=False)
        else:
            print_tables(statistics_tables(found), stdout())
        if plots is not None:
            doing("drawing the charts")
            from benchmarks.scoring.data_charts import draw_statistics

            for file in draw_statistics(found, plots, force=force):
                echo(file, err=layout != "table")


@data.command()
@_collection
@click.option("--pictures/--no-pictures", default=True, help="Whether pictures are compared, too.")
@click.option("--limit", type=click.IntRange(min=1), help="Verify only the first N trajectories.")
@click.option(
    "--tasks-file",
    type=EXISTING_FILE,
    help="The task file that was played, if it is no bundled suite.",
)
@click.option("--suite", help="The suite that was played, if it is package.module:Name.")
@with_executor_options()
@with_options(critic_options=CriticOptions, vlm_options=VLMOptions)
def verify(
    collection: Path,
    pictures: bool,
    limit: int | None,
    tasks_file: Path | None,
    suite: str | None,
    executor_options: ExecutorOptions,
    critic_options: CriticOptions,
    vlm_options: VLMOptions,
) -> int:
    """Derive every field of every trajectory anew, and report every difference from the record.

    A replay gives what was seen, the pictures, and the results and rewards of actions; the task,
    the settings and the seeds give the rest: what scripted agents decided and thought, and which
    turns are learnt. Of a model, only the critic checks the thoughts. Trajectories of kind b must
    be the key actions, those that must succeed must do so, and agents must recover from faults. The
    exit code is 1 if there is a problem.
    """
    from contextlib import ExitStack, closing
    from itertools import islice

    from benchmarks.cli.progress import Progress
    from er_gym.data.line_index import lines_of
    from er_gym.data.verify import Totals
    from er_gym.data.verify import verify as verdicts_of
    from er_gym.rollout.worker_pool import WorkerSetupError

    with bad_input():
        refuse_without_critic(critic_options, vlm_options)
        opened = _opened(collection)
        tasks = _tasks(opened, tasks_file, suite)
        doing(f"counting the trajectories of {collection}")
        number = sum(1 for _ in islice(lines_of(opened), limit))
        opened.parts()
        doing("drawing what the collection's seed draws")
        reenact = reenact_of(opened, tasks)
        if not number:
            raise BadInput(f"{collection} holds no trajectory yet; run er-gym collect again")
    totals, lines = Totals(), 0
    progress = Progress(terminal(stderr=True), str(collection), number)
    try:
        with ExitStack() as stack:
            workforce = stack.enter_context(executor_options.workforce(progress.say, processors()))
            workforce.must_see(collection)
            stack.enter_context(progress)
            verdicts = verdicts_of(
                opened,
                tasks,
                pictures=pictures,
                limit=limit,
                workers=workforce.workers,
                worker_backend=workforce.worker_backend,
                reenact=reenact,
            )
            for verdict in stack.enter_context(closing(verdicts)):
                totals.add(verdict)
                progress.episode(not verdict.problems)
                for problem in verdict.problems:
                    lines += 1
                    if lines <= _MOST_LINES:
                        print_problem(f"{verdict.id}: {problem}")
    except WorkerSetupError as error:
        raise click.ClickException(str(error)) from error
    if lines > _MOST_LINES:
        print_problem(f"and {lines - _MOST_LINES:,} more")
    echo(
        f"{collection}: {totals.trajectories - totals.wrong:,} of {totals.trajectories:,} "
        f"trajectories come out as they were recorded ({totals.turns:,} actions, "
        f"{totals.pictures:,} pictures, {totals.thoughts:,} thoughts)"
    )
    if totals.wrong:
        print_problem(_advice(opened))
    if not pictures:
        echo("Pictures were not compared.")
    if not totals.thoughts:
        echo("Thoughts were not checked: there are none, or no critic.")
    elif totals.anew < totals.thoughts:
        echo(
            f"{totals.thoughts - totals.anew:,} thoughts were not written anew and compared, since "
            "a model or another program wrote them; the critic has read them."
        )
    if totals.sentences:
        echo(
            f"The critic's rules read a claim in {totals.sentences - totals.unread:,} of "
            f"{totals.sentences:,} sentences; the others say nothing that they can check."
        )
    wrong = (
        _read_by_model(opened, critic_options, vlm_options, limit) if critic_options.critic else 0
    )
    return CRASHED if totals.wrong or wrong else 0


def _read_by_model(
    collection: Collection, options: CriticOptions, vlm: VLMOptions, limit: int | None
) -> int:
    """Let a model read the thoughts; returns the number of its objections."""
    from er_gym.rollout.agent import CannotGoOn

    wrong = 0
    try:
        for name, said in read_thoughts(collection, options, vlm, limit, echo):
            if not name:
                echo(said)
                continue
            wrong += 1
            if wrong <= _MOST_LINES:
                print_problem(f"{name}: {said}")
    except CannotGoOn as error:
        raise BadInput(f"{error}; the same command goes on from the replies that it has") from error
    return wrong


@data.command()
@_collection
@click.option(
    "--trajectory", "trajectory_id", metavar="ID", help="Which to show.  [default: list the ids]"
)
@click.option("--out", type=FILE, help="Draw pictures and thoughts into this file, PNG or JPEG.")
@click.option("--font", type=EXISTING_FILE, help="A TrueType or OpenType font for --out.")
@force_option
def show(
    collection: Path, trajectory_id: str | None, out: Path | None, font: Path | None, force: bool
) -> None:
    """Print a trajectory turn by turn, or draw it as a strip of pictures and thoughts.

    Without --trajectory: list the ids, a line each.
    """
    from benchmarks.scoring.data_show import print_trajectory
    from er_gym.data.strips import draw_strip
    from er_gym.writing import check_output, picture_format, write_picture

    if trajectory_id is None and out is not None:
        raise BadInput("--out draws one trajectory; name it with --trajectory")
    with bad_input():
        opened = _opened(collection)
        if trajectory_id is None:
            for each in _ids(opened):
                echo(each)
            return
        trajectory = _trajectory(opened, trajectory_id)
        if out is None:
            print_trajectory(trajectory, stdout())
            return
        picture_format(out)
        check_output(out, force=force)
        write_picture(out, draw_strip(trajectory, collection, font), force=force)
    echo(out)


# -- parts ----------------------------------------------------------------------------------------


def _opened(path: Path) -> Collection:
    from er_gym.data.collection import Collection

    doing(f"reading {path}")
    return Collection.open(path)


def _trajectory(collection: Collection, wanted: str) -> Trajectory:
    """The trajectory of an id; BadInput names ids that are close to it if there is none."""
    from difflib import get_close_matches

    from er_gym.data.line_index import lines_of, trajectory_at

    for line in lines_of(collection):
        if line.id == wanted:
            return trajectory_at(collection, line.offset)
    ids = _ids(collection)
    close = get_close_matches(wanted, ids, _CLOSE, cutoff=0.0) or ids[:_CLOSE]
    raise BadInput(
        f"no trajectory {wanted!r:.100} among the {len(ids):,} in {collection.path}; "
        f"close to it are: {', '.join(close)}"
    )


def _ids(collection: Collection) -> list[str]:
    """The ids of a collection's trajectories, in its order; BadInput if there is none."""
    from er_gym.data.line_index import lines_of

    ids = [line.id for line in lines_of(collection)]
    if not ids:
        raise BadInput(f"{collection.path} holds no trajectory yet; run er-gym collect again")
    return ids


def _advice(collection: Collection) -> str:
    """What to do about trajectories that come out otherwise."""
    from er_gym import __version__

    theirs = collection.manifest.er_gym
    if theirs != __version__:
        return (
            f"the collection is of er-gym {theirs}, and this is {__version__}, whose agents may "
            f"decide otherwise; verify it with er-gym {theirs}"
        )
    return (
        "do not train on these trajectories; to make them anew, remove their files "
        f"{collection.path}/parts/PART/episodes/ID.json and run the same er-gym collect again"
    )


def reenact_of(collection: Collection, tasks: Sequence[Task]) -> Reenact:
    """How the agents of a collection decide.

    Args:
        collection: the collection.
        tasks: the suite's.
    """
    from benchmarks.reenacting import reenacting
    from er_gym.data.line_index import lines_of
    from er_gym.tasks.resolve import resolve_tasks

    settings = collection.manifest.settings
    types, scenes = settings.get("tasks", ()), settings.get("scenes", ())
    chosen = [task for task in tasks if task.type.name in types and task.scene in scenes]
    sizes = {part.manifest.suite_size for part in collection.parts().values()}
    if sizes != {len(chosen)}:  # some were set aside; to find them takes long
        chosen = [*resolve_tasks(chosen, settings.get("env", {}).get("backend", "embedded")).tasks]
    return reenacting(collection.manifest, chosen, [*lines_of(collection)])


def _tasks(
    collection: Collection, tasks_file: Path | None, suite_name: str | None
) -> Sequence[Task]:
    """The tasks of the suite that was played. No module is imported that only the collection names,
    which may be a stranger's."""
    from er_gym.data.sharegpt_import import SOURCE
    from er_gym.envs.protocol import PAPER
    from er_gym.tasks.paper_format import with_every_pose
    from er_gym.tasks.suites import load_suite, suite_registry

    told = collection.manifest
    doing(f"reading the tasks of {tasks_file or suite_name or told.suite}")
    if SOURCE in told.settings:
        raise BadInput(
            f"{collection.path} was imported from a file that does not tell poses and seeds, so "
            "that its trajectories cannot be replayed; stats, show and export work on it"
        )
    if tasks_file is not None or suite_name is not None:
        suite = suite_given(suite_name, tasks_file)
    elif told.suite in suite_registry().names():
        suite = load_suite(told.suite)
    else:
        raise BadInput(
            f"{collection.path} was played in tasks of a file or of another package, "
            f"{told.suite!r:.100}; give them with --tasks-file or --suite"
        )
    if suite.digest != told.suite_digest:
        raise BadInput(
            f"the tasks of {suite.name!r:.100} are not those that {collection.path} was played in; "
            "give the same ones with --tasks-file or --suite, or use the er-gym that collected it"
        )
    if "selects" in told.settings and told.settings["env"].get("protocol") == PAPER.name:
        return with_every_pose(suite.tasks)  # as er-gym bench played them
    return suite.tasks
