"""``er-gym collect``."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.collect_expert import ExpertOptions, ExpertRun
from benchmarks.cli.collect_options import CollectOptions, refuse_misfits
from benchmarks.cli.collect_select import Selection, SelectOptions
from benchmarks.cli.errors import (
    CRASHED,
    BadInput,
    bad_input,
    entered,
    exit_code_of,
    print_problem,
    report_set_aside,
)
from benchmarks.cli.executor import ExecutorOptions, processors, with_executor_options
from benchmarks.cli.options import (
    given_size,
    named,
    seed_option,
    with_options,
)
from benchmarks.cli.suites import chosen_tasks, fitted_tasks
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.terminal import stdout, terminal

if TYPE_CHECKING:
    from agents.expert.collect import CollectSummary
    from agents.expert.players import Players
    from agents.expert.recipe import Recipe
    from agents.expert.writers.registry import NamedWriter
    from er_gym.rollout.events import Cost


@click.command(name="collect")
@with_options(options=CollectOptions, select_options=SelectOptions)
@with_executor_options()
@seed_option
@with_options(expert_options=ExpertOptions, vlm_options=VLMOptions)
def collect(
    options: CollectOptions,
    select_options: SelectOptions,
    executor_options: ExecutorOptions,
    seed: int,
    expert_options: ExpertOptions,
    vlm_options: VLMOptions,
) -> int:
    """Collect trajectories with pictures and thoughts, to train on.

    Scripted agents play the tasks of a suite: an expert that knows where objects are, and explorers
    that do not. The default recipe has the parts and proportions of the paper's training set. The
    same command continues a collection; a larger --limit extends it. `er-gym data` shows, verifies
    and exports collections. With --expert, a model writes the thoughts; its replies and their cost
    are kept in the directory. With --select, successful episodes of any agent become trajectories;
    with --correct, failed ones are corrected.
    """
    from agents.expert.collect import Collector
    from benchmarks.cli.collect_choice import chosen_recipe, source_of
    from benchmarks.cli.collect_plan import candidates, settings_of
    from benchmarks.cli.progress import CollectProgress
    from er_gym.data.collection import TRAJECTORIES, Collection
    from er_gym.locking import Locked
    from er_gym.resumable import FolderConflict
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.writing import ForeignFile

    console = terminal(stderr=True)
    out = options.out
    with bad_input():
        doing("reading the recipe and the tasks")
        refuse_misfits(options, select_options, expert_options)
        selection = Selection.of(select_options, options.recipe, expert_options.strict_thoughts)
        if selection is not None:
            expert_options = replace(expert_options, strict_thoughts=False)
        model = ExpertRun.of(expert_options, vlm_options, options.language)
        recipe: Recipe | None = None
        if selection is not None:
            suite, env = selection.source(options.suite, options.tasks_file)
            recipe = selection.collected
        else:
            suite, env = source_of(options.suite, options.tasks_file, options.correct)
        env |= given_size(options.width, options.height)
        if options.instances is not None:
            env["instances"] = options.instances
        suite = chosen_tasks(
            suite, named("--types", options.types), named("--scenes", options.scenes)
        )
        fitted = fitted_tasks(suite, env["backend"])
        if selection is None and options.correct is None:
            recipe = chosen_recipe(
                options.recipe, named("--parts", options.parts), named("--kinds", options.kinds)
            )
        settings, manifest = settings_of(
            suite, fitted.tasks, env, recipe, options, seed, model, selection
        )
        plays = selection is None and options.correct is None
        doing("planning the trajectories" if plays else "reading the episodes")
        if selection is not None:
            screening, strata = selection.strata(
                settings.tasks, options.limit, seed, options.allow_empty
            )
            left_out: dict[str, int] = {}
        else:
            strata, left_out = candidates(settings, options, model)
        make_writer = _make_writer(options.writer)
    report_set_aside(suite.name, fitted.set_aside, fitted.substitutions)
    for reason, number in left_out.items():
        console.print(f"{number} episodes left out: {reason}", style="dim", soft_wrap=True)
    total = sum(stratum.quota for stratum in strata.values())
    shown = CollectProgress(console, total)
    collector = None
    bill: Cost | None = None
    try:
        with (
            entered(lambda: Collection.locked(out, manifest)) as collection,
            executor_options.workforce(
                shown.say, processors(), agents=[options.writer]
            ) as workforce,
            _players(model, make_writer, out, shown.say) as (players, cost, read),
        ):
            if selection is not None:
                for each in selection.runs:
                    workforce.must_see(each.path)
                players = selection.players(make_writer, strata)
            collector = Collector(
                collection,
                settings,
                players,
                strata,
                executor="processes" if model is None else "threads",
                parallelism=workforce.parallelism(model.run.concurrency if model else 1),
                listeners=[shown],
                cost=cost,
                tell=shown.taken,
            )
            try:
                with shown:
                    summary = collector.collect()
            finally:
                bill = cost()
            if selection is not None:
                summary.missing.clear()  # the table says why
                yields = selection.report(screening, strata, collection, players, options.limit)
    except WorkerSetupError as error:
        raise click.ClickException(str(error)) from error
    except (FolderConflict, Locked, ForeignFile) as error:
        raise BadInput(f"{error}; nothing else in {out} has changed") from error
    except OSError as error:  # the disk is full, the share is gone
        raise BadInput(f"{error}; the same command continues {out}") from error
    except (KeyboardInterrupt, CannotGoOn) as error:
        why, code = exit_code_of(error)
        done = collector.summary.taken if collector else 0
        print_problem(
            f"{why}: {done} of {total} trajectories are in {out}; the same command continues"
        )
        if bill:
            console.print(str(bill))
        return code
    if bill:
        console.print(str(bill))
    if reading := read():
        console.print(reading, soft_wrap=True)
    console.print(_in_words(summary, out / TRAJECTORIES), soft_wrap=True)
    if selection is not None:
        from benchmarks.scoring.tables import print_tables

        print_tables([yields], stdout())
    for (part, task_type), number in summary.missing.items():
        print_problem(
            f"{part}: {number} trajectories{f' of {task_type}' if task_type else ''} are missing; "
            "the tasks yield no more"
        )
    if summary.crashed:
        print_problem(
            f"{len(summary.crashed)} episodes crashed, the first of them {summary.crashed[0]}; "
            "the same command plays them again"
        )
        return CRASHED
    return 0 if summary.taken or options.allow_empty else CRASHED


def _make_writer(name: str) -> NamedWriter:
    """Makes the writer of a name; the name is checked at once."""
    from agents.expert.writers.registry import NamedWriter

    make = NamedWriter(name)
    make()
    return make


@contextmanager
def _players(
    model: ExpertRun | None, make_writer: NamedWriter, out: Path, say: Callable[[object], None]
) -> Iterator[tuple[Players, Callable[[], Cost | None], Callable[[], str]]]:
    """Who plays, and functions that say what that has cost, and what the critic has read."""
    if model is None:
        from agents.expert.players import Thinkers

        yield Thinkers(make_writer), lambda: None, str
        return
    with model.players(out, say) as ready:
        yield ready


def _in_words(summary: CollectSummary, file: Path) -> str:
    rejected = ", ".join(
        f"{number} {reason}" for reason, number in sorted(summary.rejected.items())
    )
    lines = [f"{summary.taken} trajectories in {file}; {summary.played} episodes played now"]
    if rejected:
        lines.append(f"not taken: {rejected}")
    return "\n".join(lines)
