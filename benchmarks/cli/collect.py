"""``er-gym collect``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.collect_expert import ExpertOptions, ExpertRun
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
    EXISTING_FILE,
    EXISTING_FOLDER,
    FOLDER,
    OptionGroup,
    Words,
    given_size,
    named,
    option,
    seed_option,
    shared,
    size_option,
    with_options,
)
from benchmarks.cli.suites import chosen_tasks, fitted_tasks
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.terminal import stdout, terminal

if TYPE_CHECKING:
    from agents.expert.collect import CollectSettings, CollectSummary, Stratum
    from agents.expert.corrections import CorrectAfter, CorrectBy
    from agents.expert.players import Players
    from agents.expert.recipe import Recipe
    from agents.expert.writers.registry import NamedWriter
    from er_gym.data.collection import Collection, CollectionManifest
    from er_gym.data.trajectory import Language
    from er_gym.rollout.events import Cost
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task

LANGUAGES = ("en", "zh")


@dataclass(frozen=True)
class CollectOptions(OptionGroup):
    """What is collected, how it is recorded, and where."""

    suite: str | None = option(help="Take the tasks of a suite; `er-gym suites` lists them.")
    tasks_file: Path | None = option(type=EXISTING_FILE, help="Take the tasks of a file.")
    out: Path = option(type=FOLDER, required=True, help="The directory of the collection.")
    limit: int | None = option(
        type=click.IntRange(min=1), help="How many trajectories.  [default: the recipe's]"
    )
    recipe: str | None = option(
        metavar="NAME",
        help="What is collected: a YAML file, or the name of one of er-gym's own.  "
        "[default: paper]",
    )
    parts: str | None = option(metavar="PART,…", help="Collect only these parts of the recipe.")
    kinds: str | None = option(
        metavar="a,b,c", help="Only these kinds of the expert's trajectories."
    )
    types: str | None = option(metavar="TYPE,…", help="Only tasks of these types.")
    scenes: str | None = option(metavar="SCENE,…", help="Only tasks in these scenes.")
    instances: str | None = option(
        type=click.Choice(("target", "explore")),
        help="Which object a type name means.  [default: the suite's]",
    )
    writer: str = option(
        type=Words(),
        default="grounded",
        show_default=True,
        help="Who writes the thoughts: grounded, or package.module:Class. For a model, give "
        "--expert.",
    )
    thoughts: str = option(
        default="transitions",
        show_default=True,
        metavar="NAME",
        help="Which kinds of thoughts follow which: a YAML file, or the name of one of er-gym's "
        "own.",
    )
    language: Language = option(
        type=click.Choice(LANGUAGES),
        default="en",
        show_default=True,
        help="The language of the thoughts.",
    )
    no_pictures: bool = option(
        is_flag=True,
        help="Record what is seen in words alone, for models that read: many times as fast.",
    )
    width: int | None = shared(size_option("--width"))
    height: int | None = shared(size_option("--height"))
    correct: Path | None = option(
        type=EXISTING_FOLDER,
        metavar="RUN",
        help="Correct the failed episodes of a run of er-gym bench; give no --recipe.",
    )
    correct_after: CorrectAfter | None = option(
        type=click.Choice(("wrong", "failure", "anywhere")),
        help="With --correct: the expert takes over after the first action that did no key action; "
        "after the first that failed since the last key action, or anywhere: after up to six "
        "actions drawn at random, first among the refused ones.  [default: wrong, as in the paper]",
    )
    correct_by: CorrectBy | None = option(
        type=click.Choice(("expert", "searcher")),
        help="With --correct: who takes over. The searcher knows no more than the failed agent "
        "did.  [default: expert]",
    )
    allow_empty: bool = option(
        is_flag=True, help="With --select and --correct: end well also if no episode can be taken."
    )


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

    An expert that knows where things are, and explorers that do not, play the tasks of a suite. The
    default recipe has the parts and proportions of the paper's training set. The same command
    continues a collection; a larger --limit extends it. `er-gym data` shows, verifies and exports
    collections. With --expert, a model writes the thoughts; what it replied and cost stays in the
    directory. With --select, successful episodes of any agent become trajectories; with --correct,
    failed ones are corrected.
    """
    from agents.expert.collect import Collector
    from benchmarks.cli.collect_choice import chosen_recipe, source_of
    from benchmarks.cli.progress import CollectProgress
    from er_gym.data.collection import TRAJECTORIES, CollectionError
    from er_gym.locking import Locked
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.run_directory import RunDirectoryError
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.writing import ForeignFile

    console = terminal(stderr=True)
    out = options.out
    with bad_input():
        doing("reading the recipe and the tasks")
        _refuse_misfits(options, select_options, expert_options)
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
        settings, manifest = _settings(
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
            strata, left_out = _strata(settings, options, model)
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
            _locked(out, manifest) as collection,
            executor_options.workforce(
                shown.say, processors(), agents=[options.writer]
            ) as workforce,
            _players(model, make_writer, out, shown.say) as (players, cost),
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
    except (CollectionError, RunDirectoryError, Locked, ForeignFile) as error:
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


def _refuse_misfits(
    options: CollectOptions, select_options: SelectOptions, expert_options: ExpertOptions
) -> None:
    """Refuse options that do not go together."""
    given = [*options.given, *expert_options.given]

    def refuse(flags: Sequence[str], why: str) -> None:
        misfit = next((flag for flag in given if flag in flags), None)
        if misfit is not None:
            raise BadInput(f"{misfit} {why}")

    expert = expert_options.expert
    if expert is not None and options.no_pictures:
        raise BadInput("--no-pictures is for scripted writers; leave it or --expert out")
    if expert is not None and options.writer != "grounded":
        raise BadInput(f"give --writer {options.writer} or --expert {expert}, not both")
    if expert_options.decides and options.correct is not None:
        raise BadInput("--correct follows a plan: leave out --decisions model")
    if expert_options.decides and options.kinds is not None:
        raise BadInput("--kinds is for --decisions plan: a model that decides plays one kind")
    if select_options.select:
        flags = ("--correct", "--parts", "--kinds", "--expert")
        refuse(flags, "does not go with --select: leave one of them out")
    if options.correct is None:
        refuse(("--correct-after", "--correct-by"), "is for --correct RUN; leave it out")
    else:
        flags = ("--recipe", "--parts", "--kinds")
        refuse(flags, "is for a recipe; --correct RUN collects without one")
    if select_options.select or options.correct is not None:
        refuse(("--instances",), "is that of the run; leave it out")


def _name_of(run: Path) -> str:
    """The name of a run directory with the digest of what it plays."""
    from er_gym.rollout.run_directory import RunDirectory

    return f"{run.resolve().name} ({RunDirectory.open(run).manifest.digest})"


def _stated_corrections(options: CollectOptions) -> dict[str, str]:
    """How it is corrected, for the manifest, which does not state the paper's way."""
    stated = {"correct_after": options.correct_after, "correct_by": options.correct_by}
    return {name: given for name, given in stated.items() if given not in (None, "wrong", "expert")}


def _settings(
    suite: Suite,
    tasks: Sequence[Task],
    env: Mapping[str, Any],
    recipe: Recipe | None,
    options: CollectOptions,
    seed: int,
    model: ExpertRun | None,
    selection: Selection | None,
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
    kinds = load_thought_kinds(options.thoughts)
    pictures = None
    if not options.no_pictures:
        pictures = Pictures(quality=80, min_pixels=1, max_pixels=2**24)
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
            "writer": options.writer,
            "language": options.language,
            "env": dict(env),
            "pictures": pictures and pictures.model_dump(include={"format", "quality"}),
            **({} if options.correct is None else {"corrects": _name_of(options.correct)}),
            **({} if model is None else {"expert": model.stated}),
            **({} if selection is None else selection.stated),
            **_stated_corrections(options),
        },
        seed=seed,
        er_gym=__version__,
    )
    settings = CollectSettings(
        recipe=stated,
        tasks=tasks,
        env=env,
        play=PlaySettings(kinds, pictures, options.language),
        seed=seed,
        manifest=manifest.model_dump(mode="json"),
    )
    return settings, manifest


def _strata(
    settings: CollectSettings, options: CollectOptions, model: ExpertRun | None
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The candidates, and how many failed episodes are left out, by the reason."""
    from agents.expert.collect import correction_strata, recipe_strata
    from er_gym.rollout.run_directory import RunDirectory

    correct = options.correct
    if correct is None:
        wanted = recipe_strata(settings, options.limit)
        if model is not None and model.options.decides:
            from agents.expert.decider import ModelCandidates

            for stratum in wanted.values():
                stratum.sequence = ModelCandidates(stratum.sequence, model.run.name)
        return wanted, {}
    after, by = options.correct_after or "wrong", options.correct_by or "expert"
    run = RunDirectory.open(correct)
    strata, left_out = correction_strata(settings.tasks, run, options.limit, after, by)
    if not (strata or options.allow_empty):
        why = "; ".join(f"{number} x {reason}" for reason, number in left_out.items())
        raise BadInput(f"{correct} has no episode that can be corrected ({why or 'it is empty'})")
    return strata, left_out


def _make_writer(name: str) -> NamedWriter:
    """Makes the writer of a name; the name is checked at once."""
    from agents.expert.writers.registry import NamedWriter

    make = NamedWriter(name)
    make()
    return make


@contextmanager
def _players(
    model: ExpertRun | None, make_writer: NamedWriter, out: Path, say: Callable[[object], None]
) -> Iterator[tuple[Players, Callable[[], Cost | None]]]:
    """Who plays, and a function that says what that has cost."""
    if model is None:
        from agents.expert.players import Thinkers

        yield Thinkers(make_writer), lambda: None
        return
    with model.players(out, say) as ready:
        yield ready


@contextmanager
def _locked(out: Path, manifest: CollectionManifest) -> Iterator[Collection]:
    """The collection, for this process alone; a directory that cannot be used is bad input."""
    from er_gym.data.collection import MANIFEST, PARTS, Collection
    from er_gym.locking import exclusive_use

    with entered(lambda: exclusive_use(out)):
        try:
            with bad_input():
                collection = Collection.create(out, manifest)
            yield collection
        except BadInput:
            if not (out / PARTS).exists():  # nothing has begun: the directory is free for another
                (out / MANIFEST).unlink(missing_ok=True)
            raise


def _in_words(summary: CollectSummary, file: Path) -> str:
    rejected = ", ".join(
        f"{number} {reason}" for reason, number in sorted(summary.rejected.items())
    )
    lines = [f"{summary.taken} trajectories in {file}; {summary.played} episodes played now"]
    if rejected:
        lines.append(f"not taken: {rejected}")
    return "\n".join(lines)
