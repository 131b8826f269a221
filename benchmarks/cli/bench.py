"""``er-gym bench``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import (
    CRASHED,
    INTERRUPTED,
    STOPPED,
    BadInput,
    bad_input,
    print_problem,
    report_set_aside,
)
from benchmarks.cli.executor import ExecutorOptions, Workforce, with_executor_options
from benchmarks.cli.options import (
    EXISTING_FILE,
    MOST_SAMPLES,
    Place,
    Words,
    faults_option,
    named,
    protocol_option,
    scorer_option,
    seed_option,
    split,
)
from benchmarks.cli.vlm_options import VLMOptions, with_vlm_options
from benchmarks.terminal import stdout, terminal

if TYPE_CHECKING:
    from benchmarks.cli.progress import Progress
    from benchmarks.cli.vlm_run import VLMRun
    from er_gym.envs.faults import Faults
    from er_gym.rollout.events import Cost, EventListener
    from er_gym.rollout.run_directory import Manifest, RunDirectory
    from er_gym.rollout.runner import RunSummary
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task

_directory = Place(file_okay=False, path_type=Path)

TRACKERS = ("tensorboard", "trackio")
"""As in ``benchmarks.cli.trackers``, which imports more; a test compares."""


@click.command(name="bench")
@click.option("--suite", help="A bundled suite; `er-gym suites` lists them.")
@click.option("--tasks-file", type=EXISTING_FILE, help="A task file in the paper's format.")
@click.option(
    "--poses", type=EXISTING_FILE, help="A file of exact object poses in the paper's format."
)
@click.option(
    "--agent",
    type=Words(),
    required=True,
    help="The agent: oracle, random, searcher, zoo:NAME, rl:RUN, openai:MODEL, "
    "package.module:Class …",
)
@click.option("--out", type=_directory, help="The run directory.  [default: runs/SUITE-AGENT]")
@click.option("--limit", type=click.IntRange(min=1), help="Play no more than the first N tasks.")
@click.option(
    "--spread",
    is_flag=True,
    help="With --limit and --skip: take a fixed random sample, not the first tasks.",
)
@click.option(
    "--skip",
    type=click.IntRange(min=0),
    default=0,
    metavar="N",
    help="Leave out the N tasks that --limit N plays.",
)
@click.option(
    "--samples",
    type=click.IntRange(1, MOST_SAMPLES),
    default=1,
    show_default=True,
    help="How often each task is played, each time with another seed.",
)
@click.option(
    "--task-ids", multiple=True, metavar="ID,…", help="Play these tasks; may be repeated."
)
@click.option("--types", metavar="TYPE,…", help="Play only tasks of these types.")
@click.option("--shard", metavar="I/N", help="Play the I-th of N parts, such as 2/8.")
@click.option(
    "--track",
    multiple=True,
    type=click.Choice(TRACKERS),
    help="Log the run's figures for this program too; may be repeated.",
)
@seed_option
@click.option("--backend", help="The engine: embedded or unity.  [default: the suite's]")
@click.option(
    "--instances", help="Which object a type name means: target or explore.  [default: the suite's]"
)
@protocol_option
@faults_option
@scorer_option
@with_executor_options(default=1)
@with_vlm_options
def bench(
    suite: str | None,
    tasks_file: Path | None,
    poses: Path | None,
    agent: str,
    out: Path | None,
    limit: int | None,
    spread: bool,
    skip: int,
    samples: int,
    task_ids: tuple[str, ...],
    types: str | None,
    shard: str | None,
    track: tuple[str, ...],
    seed: int,
    backend: str | None,
    instances: str | None,
    protocol: str,
    faults: Faults | None,
    scorer: str,
    executor_options: ExecutorOptions,
    vlm_options: VLMOptions,
) -> int:
    """Play a suite with an agent and print the result table.

    The same command continues a run: it plays only the episodes that are missing. If a task cannot
    be played, the command names it and plays the others. The options from --agent-config on are for
    vision-language agents, such as openai:MODEL.
    """
    from benchmarks.cli.progress import Progress
    from benchmarks.cli.trackers import tracking
    from benchmarks.scoring.report import load_run
    from benchmarks.scoring.tables import print_tables, tables
    from er_gym import __version__
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.outcomes import Outcomes
    from er_gym.rollout.run_directory import Manifest
    from er_gym.rollout.runner import episodes_of, tell_late
    from er_gym.rollout.selection import Shard, select
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.tasks.errors import summarise_set_aside
    from er_gym.tasks.resolve import resolve_tasks
    from er_gym.thor import BackendError
    from er_gym.writing import file_stem

    console = terminal(stderr=True)
    with bad_input(BackendError):
        part = Shard.parse(shard) if shard is not None else None
        doing("reading the suite")
        asked = _load_suite(suite, tasks_file, poses, protocol)
        doing("preparing the agent")
        vlm_run = _vlm_run(agent, vlm_options)
        env = _env_kwargs(
            asked,
            agent,
            seed,
            vlm_run,
            protocol,
            faults,
            backend=backend,
            instances=instances,
        )
        fitted = resolve_tasks(asked.tasks, env["backend"])
        aside = (*asked.set_aside, *fitted.set_aside)
        if aside and not fitted.tasks:
            raise BadInput(f"{asked.name}: no task can be played: {summarise_set_aside(aside)}")
        chosen = select(
            fitted.tasks,
            task_ids=split(*task_ids),
            types=named("--types", types),
            shard=part,
            limit=limit,
            skip=skip,
            spread=spread,
            set_aside=aside,
        )
        episodes = episodes_of(chosen, samples)
        out = out or Path("runs") / f"{file_stem(asked.name)}-{file_stem(agent)}"
        manifest = Manifest(
            suite=asked.name,
            suite_digest=asked.digest,
            suite_size=len(fitted.tasks),
            agent=agent,
            agent_settings=vlm_run.comparable_settings if vlm_run else {},
            env=env,
            seed=seed,
            er_gym=__version__,
            set_aside=aside,
            taken=fitted.substitutions,
        )
    report_set_aside(asked.name, aside, fitted.substitutions)
    tuned_for = vlm_run.tuned_for if vlm_run else None
    for note in (*fitted.notes, *([f"settings of {tuned_for}"] if tuned_for else [])):
        console.print(note, style="dim", soft_wrap=True)
    if samples > 1 and vlm_run and not vlm_run.settings.sampling.temperature:
        print_problem(
            f"sampling.temperature is 0, so the {samples} samples of a task may be all alike; "
            "give --set sampling.temperature=1.0"
        )

    try:
        with _locked(out, manifest) as run_directory:
            for line in run_directory.move_aside(episodes):
                print_problem(line)
            before = Outcomes.of(each for each in run_directory.episodes() if each.key in episodes)
            progress = Progress(console, f"{asked.name}, {agent}", len(episodes), before)
            with (
                executor_options.workforce(progress.say, 1, agents=[agent]) as workforce,
                _prepared_run(run_directory, chosen, samples, workforce, agent, vlm_run) as (
                    play,
                    cost,
                ),
            ):
                tell_late(run_directory)
                with progress, tracking(track, out, manifest.model_dump()) as listeners:
                    outcome = play(progress, listeners)
                bill = cost()
    except WorkerSetupError as error:
        raise click.ClickException(f"{error}; {_left_in(out, chosen, samples)}") from error
    except OSError as error:  # the disk is full, the share is gone
        raise BadInput(f"{error}; {_left_in(out, chosen, samples)}") from error
    except (KeyboardInterrupt, CannotGoOn) as error:
        why = str(error) if isinstance(error, CannotGoOn) else "interrupted"
        print_problem(f"{why}: {_left_in(out, chosen, samples, told='same command' in why)}")
        _print_causes(out)
        return STOPPED if isinstance(error, CannotGoOn) else INTERRUPTED
    doing("computing the table")
    print_tables(tables([load_run(out)], scorer=scorer), stdout())
    if bill:
        console.print(str(bill))
    if outcome.crashed:
        first = outcome.crashed[0]
        print_problem(
            f"{len(outcome.crashed)} of {outcome.played} episodes crashed, the first of them "
            f"{first.task_id}: {first.error}; the same command plays them again"
        )
        return CRASHED
    return 0


@contextmanager
def _locked(out: Path, manifest: Manifest) -> Iterator[RunDirectory]:
    """The run directory, for this process alone; a directory that cannot be used is bad input."""
    from er_gym.rollout.run_directory import locked_run_directory

    with ExitStack() as stack:
        with bad_input():
            run_directory = stack.enter_context(locked_run_directory(out, manifest))
        yield run_directory


def _left_in(out: Path, chosen: Sequence[Task], samples: int, *, told: bool = False) -> str:
    """Say what a run that ended early has left, and how to go on, unless that was ``told``."""
    from er_gym.rollout.run_directory import MANIFEST, RunDirectory
    from er_gym.rollout.runner import finished

    if not (out / MANIFEST).exists():
        return f"no episode was played, and nothing is left in {out}"
    done = len(finished(RunDirectory.open(out), chosen, samples))
    again = "" if told else "; the same command continues"
    return f"{done} of {samples * len(chosen)} episodes are in {out}{again}"


def _print_causes(out: Path) -> None:
    """Say what was amiss with the agent's replies in a run that ended early."""
    from benchmarks.scoring.report import load_run
    from er_gym.rollout.run_directory import MANIFEST

    if (out / MANIFEST).exists():
        for words in load_run(out).causes_in_words:
            print_problem(words)


@contextmanager
def _prepared_run(
    run_directory: RunDirectory,
    chosen: Sequence[Task],
    samples: int,
    workforce: Workforce,
    agent: str,
    vlm_run: VLMRun | None,
) -> Iterator[
    tuple[Callable[[Progress, list[EventListener]], RunSummary], Callable[[], Cost | None]]
]:
    """A function that plays the chosen tasks, and one that says what that has cost."""
    from agents import NamedAgent
    from er_gym.rollout.agent import CannotGoOn
    from er_gym.rollout.executor import Parallelism
    from er_gym.rollout.runner import run

    if vlm_run is None:
        named_agent = NamedAgent(agent)
        with bad_input():
            shared = workforce.machines.shares_files
            make = named_agent if shared else named_agent.carried()
        parallelism = Parallelism(workforce.workers, machines=workforce.machines)
        yield (
            lambda shown, more: run(
                run_directory,
                chosen,
                make,
                parallelism=parallelism,
                listeners=[shown, *more],
                samples=samples,
            ),
            lambda: None,
        )
        return
    with bad_input(CannotGoOn):  # no key, no such model
        factory = vlm_run.factory(run_directory.path)
    with closing(factory):
        yield (
            lambda shown, more: vlm_run.play(
                factory,
                run_directory,
                chosen,
                workforce,
                [shown, *more],
                shown.say,
                samples=samples,
            ),
            lambda: factory.cost,
        )


def _load_suite(
    name: str | None, tasks_file: Path | None, poses: Path | None, protocol: str
) -> Suite:
    """The suite; under the paper's protocol a pose holds for its object in every task."""
    from er_gym.envs.protocol import PAPER
    from er_gym.tasks.jsonl_format import digest
    from er_gym.tasks.paper_format import read_poses, with_every_pose, with_poses
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    if (name is None) == (tasks_file is None):
        raise BadInput(f"give either --suite (one of: {', '.join(suite_names())}) or --tasks-file")
    if name is not None:
        if poses is not None:
            raise BadInput("--poses needs --tasks-file; a suite has its own poses")
        suite = load_suite(name)
    else:
        assert tasks_file is not None
        suite = suite_from_file(tasks_file)
    stated = {} if poses is None else read_poses(poses)
    if stated:
        tasks = tuple(with_poses(suite.tasks, stated, suite.places))
        suite = replace(suite, tasks=tasks, digest=digest(tasks))
    if protocol == PAPER.name:
        suite = replace(suite, tasks=tuple(with_every_pose(suite.tasks, stated)))
    return suite


def _env_kwargs(
    suite: Suite,
    agent: str,
    seed: int,
    vlm_run: VLMRun | None,
    protocol: str,
    faults: Faults | None,
    **given: str | None,
) -> dict[str, Any]:
    """The environment's arguments: the suite's, overridden by the options that were given, and the
    observations that the agent needs. This makes agent and environment once, so that bad arguments
    are found before any worker starts."""
    from agents import make_agent
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.envs.protocol import DEFAULT, protocol_named
    from er_gym.thor import BACKENDS

    env = {"backend": "embedded", **suite.env}
    if protocol != DEFAULT.name:  # so that older runs, without this entry, can be continued
        env["protocol"] = protocol
    if protocol_named(protocol).chooses_instances:
        env.pop("instances", None)
    env |= {name: value for name, value in given.items() if value is not None}
    if faults is not None:
        env["faults"] = faults
    if not env.get("faults", 0):  # likewise
        env.pop("faults", None)
    if env["backend"] not in BACKENDS:
        raise ValueError(
            f"unknown backend {env['backend']!r}; choose one of: {', '.join(BACKENDS)}"
        )
    if vlm_run is None:
        env["obs_mode"] = make_agent(agent, seed=seed).obs_mode
    else:
        env |= vlm_run.env
    EmbodiedEnv((), **env)
    return env


def _vlm_run(agent: str, vlm_options: VLMOptions) -> VLMRun | None:
    """The run of a vision-language agent; None for other agents, which take none of its options."""
    from agents.factory import is_model_agent
    from benchmarks.cli.vlm_run import VLMRun

    if is_model_agent(agent):
        return VLMRun.of(agent, vlm_options)
    if vlm_options.given:
        raise BadInput(
            f"{vlm_options.given[0]} is for vision-language agents, such as openai:MODEL, not for "
            f"{agent}"
        )
    return None
