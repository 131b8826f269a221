"""``er-gym collect``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.collect_expert import ExpertOptions, ExpertRun, with_expert_options
from benchmarks.cli.collect_select import Selection, SelectOptions, with_select_options
from benchmarks.cli.errors import (
    CRASHED,
    INTERRUPTED,
    STOPPED,
    BadInput,
    bad_input,
    entered,
    print_problem,
    report_set_aside,
)
from benchmarks.cli.executor import ExecutorOptions, processors, with_executor_options
from benchmarks.cli.options import (
    Place,
    Words,
    given_size,
    named,
    seed_option,
    size_options,
)
from benchmarks.terminal import stdout, terminal

if TYPE_CHECKING:
    from agents.expert.collect import CollectSettings, CollectSummary, Stratum
    from agents.expert.corrections import CorrectAfter, CorrectBy
    from agents.expert.players import Players
    from agents.expert.recipe import Recipe
    from agents.expert.writers.registry import NamedWriter
    from benchmarks.cli.collect_progress import CollectProgress
    from er_gym.data.collection import CollectionManifest
    from er_gym.rollout.events import Cost
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task

LANGUAGES = ("en", "zh")
_directory = Place(file_okay=False, path_type=Path)
_existing_file = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command(name="collect")
@click.option("--suite", help="Take the tasks of a suite; `er-gym suites` lists them.")
@click.option("--tasks-file", type=_existing_file, help="Take the tasks of a file.")
@click.option("--out", type=_directory, required=True, help="The directory of the collection.")
@click.option(
    "--limit", type=click.IntRange(min=1), help="How many trajectories.  [default: the recipe's]"
)
@click.option(
    "--recipe",
    metavar="NAME",
    help="What is collected: a YAML file, or the name of one of er-gym's own.  [default: paper]",
)
@click.option("--parts", metavar="PART,…", help="Collect only these parts of the recipe.")
@click.option("--kinds", metavar="a,b,c", help="Only these kinds of the expert's trajectories.")
@click.option("--types", metavar="TYPE,…", help="Only tasks of these types.")
@click.option("--scenes", metavar="SCENE,…", help="Only tasks in these scenes.")
@click.option(
    "--instances",
    type=click.Choice(("target", "explore")),
    help="Which object a type name means.  [default: the suite's]",
)
@click.option(
    "--writer",
    type=Words(),
    default="grounded",
    show_default=True,
    help="Who writes the thoughts: grounded, or package.module:Class. For a model, give --expert.",
)
@click.option(
    "--thoughts",
    default="transitions",
    show_default=True,
    metavar="NAME",
    help="Which kinds of thoughts follow which: a YAML file, or the name of one of er-gym's own.",
)
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    default="en",
    show_default=True,
    help="The language of the thoughts.",
)
@click.option(
    "--no-pictures",
    is_flag=True,
    help="Record what is seen in words alone, for models that read: many times as fast.",
)
@size_options
@click.option(
    "--correct",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="RUN",
    help="Correct the failed episodes of a run of er-gym bench; give no --recipe.",
)
@click.option(
    "--correct-after",
    type=click.Choice(("wrong", "failure", "anywhere")),
    help="With --correct: the expert takes over after the first action that did no key action; "
    "after the first that failed since the last key action, or anywhere: after up to six "
    "actions drawn at random, first among the refused ones.  [default: wrong, as in the paper]",
)
@click.option(
    "--correct-by",
    type=click.Choice(("expert", "searcher")),
    help="With --correct: who takes over. The searcher knows no more than the failed agent did.  "
    "[default: expert]",
)
@click.option(
    "--allow-empty",
    is_flag=True,
    help="With --select and --correct: end well also if no episode can be taken.",
)
@with_select_options
@with_executor_options()
@seed_option
@with_expert_options
def collect(
    suite: str | None,
    tasks_file: Path | None,
    out: Path,
    limit: int | None,
    recipe: str | None,
    parts: str | None,
    kinds: str | None,
    types: str | None,
    scenes: str | None,
    instances: str | None,
    writer: str,
    thoughts: str,
    language: str,
    no_pictures: bool,
    width: int | None,
    height: int | None,
    correct: Path | None,
    correct_after: CorrectAfter | None,
    correct_by: CorrectBy | None,
    allow_empty: bool,
    seed: int,
    executor_options: ExecutorOptions,
    expert_options: ExpertOptions,
    select_options: SelectOptions,
) -> int:
    """Collect trajectories with pictures and thoughts, to train on.

    An expert that knows where things are, and explorers that do not, play the tasks of a suite. The
    default recipe has the parts and proportions of the paper's training set. The same command
    continues a collection; a larger --limit extends it. `er-gym data` shows, verifies and exports
    collections. With --expert, a model writes the thoughts; what it replied and cost stays in the
    directory. With --select, successful episodes of any agent become trajectories; with --correct,
    failed ones are corrected.
    """
    from agents.expert.collect import Collector
    from benchmarks.cli.collect_choice import chosen_recipe, chosen_tasks, fitted_tasks, source_of
    from benchmarks.cli.collect_progress import CollectProgress
    from er_gym.data.collection import TRAJECTORIES, Collection
    from er_gym.locking import Locked
    from er_gym.resumable import FolderConflict
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.executor import Parallelism
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.writing import ForeignFile

    console = terminal(stderr=True)
    with bad_input():
        doing("reading the recipe and the tasks")
        selection = Selection.of(
            select_options,
            recipe,
            expert_options.strict_thoughts,
            {
                "--correct": correct is not None,
                "--parts": parts is not None,
                "--kinds": kinds is not None,
                "--expert": expert_options.expert is not None,
            },
        )
        if selection is not None:
            expert_options = replace(expert_options, strict_thoughts=False)
        model = ExpertRun.of(expert_options, language)  # type: ignore[arg-type]
        if model is not None:
            if no_pictures:
                raise BadInput("--no-pictures is for scripted writers; leave it or --expert out")
            _refuse_misfits(model, writer, kinds, correct)
        asked: Recipe | None = None
        if selection is not None:
            source, env = selection.source(suite, tasks_file)
            asked = selection.collected
        else:
            source, env = source_of(suite, tasks_file, correct)
        env |= given_size(width, height)
        if instances is not None:
            if selection is not None or correct is not None:
                raise BadInput("--instances is that of the run; leave it out")
            env["instances"] = instances
        source = chosen_tasks(source, named("--types", types), named("--scenes", scenes))
        fitted = fitted_tasks(source, env["backend"])
        for option, given in (("--correct-after", correct_after), ("--correct-by", correct_by)):
            if correct is None and given is not None:
                raise BadInput(f"{option} is for --correct RUN; leave it out")
        if correct is not None:
            _refuse_recipe({"--recipe": recipe, "--parts": parts, "--kinds": kinds})
        elif selection is None:
            asked = chosen_recipe(recipe, named("--parts", parts), named("--kinds", kinds))
        settings, manifest = _settings(
            source,
            fitted.tasks,
            env,
            asked,
            correct,
            model,
            language=language,
            seed=seed,
            writer=writer,
            table=thoughts,
            has_pictures=not no_pictures,
            stated_too=(selection.stated if selection else {})
            | ({"correct_after": correct_after} if correct_after not in (None, "wrong") else {})
            | ({"correct_by": correct_by} if correct_by == "searcher" else {}),
        )
        doing("reading the episodes" if selection or correct else "planning the trajectories")
        if selection is not None:
            screening, strata = selection.strata(settings.tasks, limit, seed, allow_empty)
            left_out: dict[str, int] = {}
        else:
            how = correct_after or "wrong", correct_by or "expert"
            strata, left_out = _strata(settings, correct, how, limit, model, allow_empty)
        make_writer = _make_writer(writer)
    report_set_aside(source.name, fitted.set_aside, fitted.substitutions)
    for reason, number in left_out.items():
        console.print(f"{number} episodes left out: {reason}", style="dim", soft_wrap=True)
    total = sum(stratum.quota for stratum in strata.values())
    shown = CollectProgress(console, total)
    collector = None
    bill: Cost | None = None
    try:
        with (
            entered(Collection.locked(out, manifest)) as collection,
            executor_options.workforce(shown.say, processors(), agents=[writer]) as workforce,
            _players(model, make_writer, out, shown) as ready,
        ):
            if selection is not None:
                for each in selection.runs:
                    workforce.must_see(each.path)
            players, cost = ready
            if selection is not None:
                players = selection.players(make_writer, strata)
            collector = Collector(
                collection,
                settings,
                players,
                strata,
                executor="processes" if model is None else "threads",
                parallelism=Parallelism(
                    workforce.workers,
                    model.run.concurrency if model else 1,
                    machines=workforce.machines,
                ),
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
                yields = selection.report(screening, strata, collection, players, limit)
    except WorkerSetupError as error:
        raise click.ClickException(str(error)) from error
    except (FolderConflict, Locked, ForeignFile) as error:
        raise BadInput(f"{error}; nothing else in {out} has changed") from error
    except OSError as error:  # the disk is full, the share is gone
        raise BadInput(f"{error}; the same command continues {out}") from error
    except (KeyboardInterrupt, CannotGoOn) as error:
        why = str(error) if isinstance(error, CannotGoOn) else "interrupted"
        done = collector.summary.taken if collector else 0
        print_problem(
            f"{why}: {done} of {total} trajectories are in {out}; the same command continues"
        )
        if bill:
            console.print(str(bill))
        return STOPPED if isinstance(error, CannotGoOn) else INTERRUPTED
    if bill:
        console.print(str(bill))
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
    return 0 if summary.taken or allow_empty else CRASHED


def _settings(
    suite: Suite,
    tasks: Sequence[Task],
    env: Mapping[str, Any],
    recipe: Recipe | None,
    correct: Path | None,
    model: ExpertRun | None,
    *,
    language: Any,
    seed: int,
    writer: str,
    table: str,
    has_pictures: bool,
    stated_too: Mapping[str, Any],
) -> tuple[CollectSettings, CollectionManifest]:
    """What decides the trajectories, and the manifest that states it."""
    from agents.expert.collect import CollectSettings, corrections_recipe
    from agents.expert.players import PlaySettings
    from agents.expert.thought_kinds import load_thought_kinds
    from agents.vlm.settings import Pictures
    from er_gym import __version__
    from er_gym.data.collection import CollectionManifest
    from er_gym.envs.embodied_env import EmbodiedEnv

    if model is not None:
        env = {**env, **model.env}
    EmbodiedEnv((), **env)  # so that bad arguments are found before any worker starts
    kinds = load_thought_kinds(table)
    pictures = Pictures(quality=80, min_pixels=1, max_pixels=2**24) if has_pictures else None
    stated = corrections_recipe() if recipe is None else recipe
    if model is not None and model.options.decides:
        from agents.expert.decider import model_recipe

        stated = model_recipe(stated)
    manifest = CollectionManifest(
        suite=suite.name,
        suite_digest=suite.digest,
        settings={
            "recipe": stated.model_dump(mode="json", exclude={"description"}),
            "tasks": sorted({task.type.name for task in suite.tasks}),
            "scenes": sorted({task.scene for task in suite.tasks}),
            "thoughts": kinds.model_dump(mode="json"),
            "writer": writer,
            "language": language,
            "env": dict(env),
            "pictures": pictures and pictures.model_dump(include={"format", "quality"}),
            **({} if correct is None else {"corrects": _name_of(correct)}),
            **({} if model is None else {"expert": model.stated}),
            **stated_too,
        },
        seed=seed,
        er_gym=__version__,
    )
    settings = CollectSettings(
        recipe=stated,
        tasks=tasks,
        env=env,
        play=PlaySettings(kinds, pictures, language),
        seed=seed,
        manifest=manifest.model_dump(mode="json"),
    )
    return settings, manifest


def _name_of(run: Path) -> str:
    """The name of a run directory with the digest of what it plays."""
    from er_gym.rollout.run_directory import RunDirectory

    return f"{run.resolve().name} ({RunDirectory.open(run).manifest.digest})"


def _strata(
    settings: CollectSettings,
    correct: Path | None,
    how: tuple[CorrectAfter, CorrectBy],
    limit: int | None,
    model: ExpertRun | None,
    allow_empty: bool,
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The candidates, and how many failed episodes are left out, by the reason.

    Args:
        settings: of the collection.
        correct: the run whose failures are corrected; None for a recipe.
        how: after which action somebody takes over, and who.
        limit: how many trajectories in all.
        model: the expert's, if it is one.
        allow_empty: whether a run may have nothing to correct.
    """
    from agents.expert.collect import correction_strata, recipe_strata
    from er_gym.rollout.run_directory import RunDirectory

    if correct is None:
        wanted = recipe_strata(settings, limit)
        if model is not None and model.options.decides:
            from agents.expert.decider import ModelCandidates

            for stratum in wanted.values():
                stratum.sequence = ModelCandidates(stratum.sequence, model.run.name)
        return wanted, {}
    strata, left_out = correction_strata(settings.tasks, RunDirectory.open(correct), limit, *how)
    if not (strata or allow_empty):
        why = "; ".join(f"{number} x {reason}" for reason, number in left_out.items())
        raise BadInput(f"{correct} has no episode that can be corrected ({why or 'it is empty'})")
    return strata, left_out


def _make_writer(name: str) -> NamedWriter:
    """Makes the writer of a name; the name is checked at once."""
    from agents.expert.writers.registry import NamedWriter

    make = NamedWriter(name)
    make()
    return make


def _refuse_recipe(options: Mapping[str, str | None]) -> None:
    """What --correct collects needs no recipe."""
    for option, given in options.items():
        if given is not None:
            raise BadInput(f"{option} is for a recipe; --correct RUN collects without one")


def _refuse_misfits(model: ExpertRun, writer: str, kinds: str | None, correct: Path | None) -> None:
    """Options that do not go with a model."""
    if writer != "grounded":
        raise BadInput(f"give --writer {writer} or --expert {model.run.name}, not both")
    if model.options.decides and correct is not None:
        raise BadInput("--correct follows a plan: leave out --decisions model")
    if model.options.decides and kinds is not None:
        raise BadInput("--kinds is for --decisions plan: a model that decides plays one kind")


@contextmanager
def _players(
    model: ExpertRun | None, make_writer: NamedWriter, out: Path, shown: CollectProgress
) -> Iterator[tuple[Players, Callable[[], Cost | None]]]:
    """Who plays, and a function that says what that has cost."""
    if model is None:
        from agents.expert.players import Thinkers

        yield Thinkers(make_writer), lambda: None
        return
    with model.players(out, shown.say) as ready:
        yield ready


def _in_words(summary: CollectSummary, file: Path) -> str:
    rejected = ", ".join(
        f"{number} {reason}" for reason, number in sorted(summary.rejected.items())
    )
    lines = [f"{summary.taken} trajectories in {file}; {summary.played} episodes played now"]
    if rejected:
        lines.append(f"not taken: {rejected}")
    return "\n".join(lines)
