"""``er-gym collect``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import (
    CRASHED,
    INTERRUPTED,
    STOPPED,
    BadInput,
    bad_input,
    print_problem,
)
from benchmarks.cli.options import Place, Words, seed_option, split, workers_option
from benchmarks.cli.terminal import terminal

if TYPE_CHECKING:
    from agents.expert.collect import CollectSettings, CollectSummary, Stratum
    from agents.expert.recipe import Recipe
    from agents.expert.writers.base import ThoughtWriter
    from er_gym.data.collection import Collection, CollectionManifest
    from er_gym.tasks.suites import Suite

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
    default="paper",
    show_default=True,
    metavar="NAME",
    help="What is collected: a YAML file, or the name of one of er-gym's own.",
)
@click.option("--parts", metavar="PART,…", help="Collect only these parts of the recipe.")
@click.option("--kinds", metavar="a,b,c", help="Only these kinds of the expert's trajectories.")
@click.option("--types", metavar="TYPE,…", help="Only tasks of these types.")
@click.option("--scenes", metavar="SCENE,…", help="Only tasks in these scenes.")
@click.option(
    "--writer",
    type=Words(),
    default="grounded",
    show_default=True,
    help="Who writes the thoughts: grounded, or package.module:Class.",
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
    "--correct",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="RUN",
    help="Correct the failed episodes of a run of er-gym bench; give no --recipe.",
)
@workers_option
@seed_option
def collect(
    suite: str | None,
    tasks_file: Path | None,
    out: Path,
    limit: int | None,
    recipe: str,
    parts: str | None,
    kinds: str | None,
    types: str | None,
    scenes: str | None,
    writer: str,
    thoughts: str,
    language: str,
    correct: Path | None,
    workers: int,
    seed: int,
) -> int:
    """Collect trajectories with pictures and thoughts, to train on.

    An expert that knows where things are, and explorers that do not, play the tasks of a suite. The
    default recipe has the parts and proportions of the paper's training set. The same command
    continues a collection; a larger --limit extends it. `er-gym data` shows, verifies and exports
    collections.
    """
    from er_gym.data.collection import TRAJECTORIES
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.worker_pool import WorkerSetupError

    console = terminal(stderr=True)
    with bad_input():
        source, env = _source(suite, tasks_file, correct)
        source = _chosen(source, split(types), split(scenes))
        asked = _recipe(recipe, split(parts), split(kinds)) if correct is None else None
        settings, manifest = _settings(
            source, env, asked, correct, language=language, seed=seed, writer=writer, table=thoughts
        )
        strata, left_out = _strata(settings, correct, limit)
        make_writer = _make_writer(writer)
    for reason, number in left_out.items():
        console.print(f"{number} episodes left out: {reason}", style="dim", soft_wrap=True)
    try:
        with _locked(out, manifest) as collection:
            total = sum(stratum.quota for stratum in strata.values())
            shown = CollectProgress(console, total)
            with shown:
                summary = _collect(collection, settings, make_writer, strata, workers, shown)
    except WorkerSetupError as error:
        raise click.ClickException(str(error)) from error
    except OSError as error:  # the disk is full, the share is gone
        raise BadInput(f"{error}; the same command continues {out}") from error
    except (KeyboardInterrupt, CannotGoOn) as error:
        why = str(error) if isinstance(error, CannotGoOn) else "interrupted"
        print_problem(f"{why}: the same command continues {out}")
        return STOPPED if isinstance(error, CannotGoOn) else INTERRUPTED
    console.print(_in_words(summary, out / TRAJECTORIES), soft_wrap=True)
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
    return 0


class CollectProgress:
    """Shows how many trajectories are taken: a live bar on a terminal, a few lines elsewhere."""

    def __init__(self, console: Any, total: int) -> None:
        from benchmarks.cli.progress import bar

        self._console, self._total = console, total
        self._taken = self._played = 0
        self._told = 0
        self._bar = bar(console)
        self._task = self._bar.add_task("trajectories", total=total, status="starting")

    def __enter__(self) -> CollectProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def __call__(self, event: object) -> None:
        """Hear of an event of a run."""
        from er_gym.rollout.events import EpisodeEnded

        if isinstance(event, EpisodeEnded):
            self._played += 1
            self._show()

    def taken(self, part: str, number: int) -> None:
        """Hear how many trajectories are taken so far, of all parts."""
        self._taken = number
        self._bar.update(self._task, description=part)
        self._show()
        tenth = 10 * number // max(self._total, 1)
        if not self._console.is_terminal and tenth > self._told:
            self._told = tenth
            self._console.print(
                f"{part}: {number}/{self._total} trajectories, {self._played} episodes played",
                soft_wrap=True,
            )

    def _show(self) -> None:
        self._bar.update(
            self._task, completed=self._taken, status=f"{self._played} episodes played"
        )


def _source(
    name: str | None, tasks_file: Path | None, correct: Path | None
) -> tuple[Suite, dict[str, Any]]:
    """The suite with the tasks, and the environment in which they are played."""
    from er_gym.rollout.run_directory import RunDirectory
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    if name is not None and tasks_file is not None:
        raise BadInput("give --suite or --tasks-file, not both")
    if correct is None:
        if name is None and tasks_file is None:
            raise BadInput(f"give --suite (one of: {', '.join(suite_names())}) or --tasks-file")
        suite = load_suite(name) if name is not None else suite_from_file(_given(tasks_file))
        return suite, {"backend": "embedded", **suite.env}
    manifest = RunDirectory.open(correct).manifest
    if tasks_file is not None:
        suite = suite_from_file(tasks_file)
    else:
        suite = load_suite(name or manifest.suite)
    if suite.digest != manifest.suite_digest:
        raise BadInput(
            f"{correct} was played with other tasks than those of {suite.name}; give the --suite "
            f"or --tasks-file of that run, which was {manifest.suite}"
        )
    env = {key: value for key, value in manifest.env.items() if key not in ("obs_mode", "faults")}
    # Pictures are drawn at the suite's size, whatever the run's agent looked at.
    return suite, {**env, **{key: suite.env[key] for key in _SIZE if key in suite.env}}


_SIZE = ("width", "height")


def _given(path: Path | None) -> Path:
    assert path is not None
    return path


def _chosen(suite: Suite, types: Sequence[str], scenes: Sequence[str]) -> Suite:
    """The suite with only the tasks that were asked for."""
    from er_gym.tasks.types import task_type

    wanted = {task_type(name).name for name in types}
    there = {task.scene for task in suite.tasks}
    unknown = [scene for scene in scenes if scene not in there]
    if unknown:
        raise BadInput(f"{suite.name} has no task in {unknown[0]}; it plays in {len(there)} scenes")
    tasks = tuple(
        task
        for task in suite.tasks
        if (not wanted or task.type.name in wanted) and (not scenes or task.scene in scenes)
    )
    if not tasks:
        raise BadInput(f"{suite.name} has no task of the types {', '.join(sorted(wanted))}")
    return replace(suite, tasks=tasks)


def _recipe(name: str, parts: Sequence[str], kinds: Sequence[str]) -> Recipe:
    """The recipe with only the parts and kinds that were asked for."""
    from agents.expert.recipe import load_recipe

    recipe = load_recipe(name)
    for part in parts:
        if part not in recipe.parts:
            raise BadInput(f"unknown part {part!r}; the recipe has: {', '.join(recipe.parts)}")
    chosen = {part: row for part, row in recipe.parts.items() if not parts or part in parts}
    if kinds:
        chosen = _of_kinds(chosen, kinds)
    return recipe.model_copy(update={"parts": chosen})


def _of_kinds(parts: Mapping[str, Any], kinds: Sequence[str]) -> dict[str, Any]:
    """The parts in which an expert plays these kinds, with no other kinds."""
    known = dict.fromkeys(kind for row in parts.values() for kind in row.kinds)
    for kind in kinds:
        if kind not in known:
            raise BadInput(f"unknown kind {kind!r}; the recipe has: {', '.join(known)}")
    left = {}
    for name, row in parts.items():
        shares = {kind: share for kind, share in row.kinds.items() if kind in kinds}
        if shares:
            left[name] = row.model_copy(update={"kinds": shares})
    return left


def _settings(
    suite: Suite,
    env: Mapping[str, Any],
    recipe: Recipe | None,
    correct: Path | None,
    *,
    language: Any,
    seed: int,
    writer: str,
    table: str,
) -> tuple[CollectSettings, CollectionManifest]:
    """What decides the trajectories, and the manifest that states it."""
    from agents.expert.collect import CollectSettings, corrections_recipe
    from agents.expert.thought_kinds import load_thought_kinds
    from agents.vlm.settings import Pictures
    from er_gym import __version__
    from er_gym.data.collection import CollectionManifest
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.tasks.resolve import resolve_tasks

    EmbodiedEnv((), **env)  # so that bad arguments are found before any worker starts
    kinds = load_thought_kinds(table)
    pictures = Pictures(quality=80, min_pixels=1, max_pixels=2**24)
    stated = corrections_recipe() if recipe is None else recipe
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
            "pictures": pictures.model_dump(mode="json", include={"format", "quality"}),
            **({} if correct is None else {"corrects": correct.name}),
        },
        seed=seed,
        er_gym=__version__,
    )
    settings = CollectSettings(
        recipe=stated,
        tasks=resolve_tasks(suite.tasks, env["backend"]).tasks,
        env=env,
        kinds=kinds,
        pictures=pictures,
        language=language,
        seed=seed,
        manifest=manifest.model_dump(mode="json"),
    )
    return settings, manifest


def _strata(
    settings: CollectSettings, correct: Path | None, limit: int | None
) -> tuple[dict[tuple[str, str], Stratum], dict[str, int]]:
    """The candidates, and how many failed episodes are left out, by the reason."""
    from agents.expert.collect import correction_strata, recipe_strata
    from er_gym.rollout.run_directory import RunDirectory

    if correct is None:
        return recipe_strata(settings, limit), {}
    strata, left_out = correction_strata(settings.tasks, RunDirectory.open(correct), limit)
    if not strata:
        why = "; ".join(f"{number} x {reason}" for reason, number in left_out.items())
        raise BadInput(f"{correct} has no episode that can be corrected ({why or 'it is empty'})")
    return strata, left_out


def _make_writer(name: str) -> Callable[[], ThoughtWriter]:
    """Makes the writer of a name; the name is checked at once."""
    from agents.expert.writers.registry import NamedWriter

    make = NamedWriter(name)
    make()
    return make


@contextmanager
def _locked(out: Path, manifest: CollectionManifest) -> Iterator[Collection]:
    """The collection, for this process alone; a directory that cannot be used is bad input."""
    from er_gym.data.collection import Collection
    from er_gym.locking import exclusive_use

    with bad_input():
        lock = exclusive_use(out)
        lock.__enter__()
    try:
        with bad_input():
            collection = Collection.create(out, manifest)
        yield collection
    finally:
        lock.__exit__(None, None, None)


def _collect(
    collection: Collection,
    settings: CollectSettings,
    make_writer: Callable[[], ThoughtWriter],
    strata: Mapping[tuple[str, str], Stratum],
    workers: int,
    shown: CollectProgress,
) -> CollectSummary:
    from agents.expert.collect import Collector
    from er_gym.rollout.executor import Parallelism

    return Collector(
        collection,
        settings,
        make_writer,
        strata,
        parallelism=Parallelism(workers),
        listeners=[shown],
        tell=shown.taken,
    ).collect()


def _in_words(summary: CollectSummary, file: Path) -> str:
    rejected = ", ".join(
        f"{number} {reason}" for reason, number in sorted(summary.rejected.items())
    )
    lines = [f"{summary.taken} trajectories in {file}; {summary.played} episodes played now"]
    if rejected:
        lines.append(f"not taken: {rejected}")
    return "\n".join(lines)
