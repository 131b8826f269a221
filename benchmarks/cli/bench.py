"""``er-gym bench``."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import (
    CRASHED,
    BadInput,
    bad_input,
    entered,
    exit_code_of,
    print_problem,
    report_set_aside,
)
from benchmarks.cli.executor import ExecutorOptions, Workforce, with_executor_options
from benchmarks.cli.options import (
    EXISTING_FILE,
    FOLDER,
    LANGUAGES,
    MOST_SAMPLES,
    MOST_SEED,
    OptionGroup,
    Words,
    faults_option,
    named,
    option,
    protocol_option,
    scorer_option,
    seed_option,
    shared_option,
    split,
    with_options,
)
from benchmarks.cli.suites import fitted_tasks, fresh_suite, suite_given
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.terminal import stdout, terminal

if TYPE_CHECKING:
    from benchmarks.cli.progress import Progress
    from benchmarks.vlm_run import VLMRun
    from er_gym.envs.faults import Faults
    from er_gym.rollout.events import Cost, EventListener
    from er_gym.rollout.run_directory import RunDirectory
    from er_gym.rollout.runner import RunSummary
    from er_gym.tasks.suites import Suite
    from er_gym.tasks.task import Task
    from er_gym.tasks.wordings.instructions import Language

TRACKERS = ("tensorboard", "trackio")
"""As in ``benchmarks.cli.trackers``, which imports more; a test compares."""


@dataclass(frozen=True)
class BenchOptions(OptionGroup):
    """What is played, by whom, by which rules, and where the run is written."""

    suite: str | None = option(help="A bundled suite; `er-gym suites` lists them.")
    fresh: int | None = option(
        type=click.IntRange(0, MOST_SEED),
        metavar="SEED",
        help="Play new tasks, made as the suite's configuration says, from another seed.",
    )
    language: str | None = option(
        type=click.Choice(LANGUAGES),
        help="The language of the instructions.  [default: that of the tasks]",
    )
    tasks_file: Path | None = option(type=EXISTING_FILE, help="A task file in the paper's format.")
    poses: Path | None = option(
        type=EXISTING_FILE, help="A file of exact object poses in the paper's format."
    )
    agent: str = option(
        type=Words(),
        required=True,
        help="The agent: oracle, random, searcher, spotter, mask-reader, zoo:NAME, rl:RUN, "
        "openai:MODEL, package.module:Class …",
    )
    out: Path | None = option(type=FOLDER, help="The run directory.  [default: runs/SUITE-AGENT]")
    limit: int | None = option(
        type=click.IntRange(min=1), help="Play no more than the first N tasks."
    )
    spread: bool = option(
        is_flag=True,
        help="With --limit and --skip: take a fixed random sample, not the first tasks.",
    )
    skip: int = option(
        type=click.IntRange(min=0),
        default=0,
        metavar="N",
        help="Leave out the N tasks that --limit N plays.",
    )
    samples: int = option(
        type=click.IntRange(1, MOST_SAMPLES),
        default=1,
        show_default=True,
        help="How often each task is played, each time with another seed.",
    )
    task_ids: tuple[str, ...] = option(
        multiple=True, metavar="ID,…", help="Play these tasks; may be repeated."
    )
    types: str | None = option(metavar="TYPE,…", help="Play only tasks of these types.")
    shard: str | None = option(metavar="I/N", help="Play the I-th of N parts, such as 2/8.")
    track: tuple[str, ...] = option(
        multiple=True,
        type=click.Choice(TRACKERS),
        help="Also log the run's figures in the format of this program; may be repeated.",
    )
    seed: int = shared_option(seed_option)
    backend: str | None = option(help="The engine: embedded or unity.  [default: the suite's]")
    instances: str | None = option(
        help="Which object a type name means: target or explore.  [default: the suite's]",
    )
    protocol: str = shared_option(protocol_option)
    faults: Faults | None = shared_option(faults_option)
    scorer: str = shared_option(scorer_option)


@click.command(name="bench")
@with_options(options=BenchOptions)
@with_executor_options(default=1)
@with_options(vlm_options=VLMOptions)
def bench(options: BenchOptions, executor_options: ExecutorOptions, vlm_options: VLMOptions) -> int:
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
    from er_gym.rollout.run_directory import Manifest, RunDirectory
    from er_gym.rollout.runner import append_missing_events, episodes_of
    from er_gym.rollout.selection import Shard, select
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.thor import BackendError
    from er_gym.writing import file_stem

    console = terminal(stderr=True)
    agent, samples = options.agent, options.samples
    with bad_input(BackendError):
        part = Shard.parse(options.shard) if options.shard is not None else None
        doing("reading the suite")
        suite = _load_suite(options, executor_options.workers)
        doing("preparing the agent")
        vlm_run = _vlm_run(agent, vlm_options)
        env = _env_kwargs(suite, options, vlm_run)
        fitted = fitted_tasks(suite, env["backend"])
        chosen = select(
            fitted.tasks,
            task_ids=split(*options.task_ids),
            types=named("--types", options.types),
            shard=part,
            limit=options.limit,
            skip=options.skip,
            spread=options.spread,
            set_aside=fitted.set_aside,
        )
        episodes = episodes_of(chosen, samples)
        out = options.out or Path("runs") / f"{file_stem(suite.name)}-{file_stem(agent)}"
        manifest = Manifest(
            suite=suite.name,
            suite_digest=suite.digest,
            suite_size=len(fitted.tasks),
            agent=agent,
            agent_settings=vlm_run.comparable_settings if vlm_run else {},
            env=env,
            seed=options.seed,
            er_gym=__version__,
            set_aside=fitted.set_aside,
            taken=fitted.substitutions,
        )
    report_set_aside(suite.name, fitted.set_aside, fitted.substitutions)
    tuned_for = vlm_run.tuned_for if vlm_run else None
    for note in (*fitted.notes, *([f"settings of {tuned_for}"] if tuned_for else [])):
        console.print(note, style="dim", soft_wrap=True)
    if samples > 1 and vlm_run and not vlm_run.settings.sampling.temperature:
        print_problem(
            f"sampling.temperature is 0, so the {samples} samples of a task may be all alike; "
            "give --set sampling.temperature=1.0"
        )

    try:
        with entered(lambda: RunDirectory.locked(out, manifest)) as run_directory:
            for line in run_directory.move_aside(episodes):
                print_problem(line)
            before = Outcomes.of(each for each in run_directory.episodes() if each.key in episodes)
            progress = Progress(console, f"{suite.name}, {agent}", len(episodes), before)
            with (
                executor_options.workforce(progress.say, 1, agents=[agent]) as workforce,
                _prepared_run(run_directory, chosen, samples, workforce, agent, vlm_run) as (
                    play,
                    cost,
                ),
            ):
                append_missing_events(run_directory)
                tracked = tracking(options.track, out, manifest.model_dump())
                with progress, tracked as listeners:
                    outcome = play(progress, listeners)
                bill = cost()
    except WorkerSetupError as error:
        raise click.ClickException(f"{error}; {_left_in(out, chosen, samples)}") from error
    except OSError as error:  # the disk is full, the share is gone
        raise BadInput(f"{error}; {_left_in(out, chosen, samples)}") from error
    except (KeyboardInterrupt, CannotGoOn) as error:
        why, code = exit_code_of(error)
        print_problem(f"{why}: {_left_in(out, chosen, samples, says_how='same command' in why)}")
        _print_causes(out)
        return code
    doing("computing the table")
    print_tables(tables([load_run(out)], scorer=options.scorer), stdout())
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


def _left_in(out: Path, chosen: Sequence[Task], samples: int, *, says_how: bool = False) -> str:
    """Say what a run that ended early has left and how to go on, unless its reason ``says_how``."""
    from er_gym.rollout.run_directory import MANIFEST, RunDirectory
    from er_gym.rollout.runner import finished

    if not (out / MANIFEST).exists():
        return f"no episode was played, and nothing is left in {out}"
    done = len(finished(RunDirectory.open(out), chosen, samples))
    again = "" if says_how else "; the same command continues"
    return f"{done} of {samples * len(chosen)} episodes are in {out}{again}"


def _print_causes(out: Path) -> None:
    """Print the causes of unusable replies in a run that ended early."""
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
    from er_gym.rollout.runner import run

    if vlm_run is None:
        named_agent = NamedAgent(agent)
        with bad_input():
            shared = workforce.worker_backend.shares_files
            make = named_agent if shared else named_agent.carried()
        yield (
            lambda shown, more: run(
                run_directory,
                chosen,
                make,
                parallelism=workforce.parallelism(),
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
                workforce.parallelism(),
                [shown, *more],
                shown.say,
                samples=samples,
            ),
            lambda: factory.cost,
        )


def _load_suite(options: BenchOptions, workers: int | None) -> Suite:
    """The suite; under the paper's protocol a pose holds for its object in every task."""
    from er_gym.envs.protocol import PAPER
    from er_gym.tasks.jsonl_format import digest
    from er_gym.tasks.paper_format import read_poses, with_every_pose, with_poses
    from er_gym.tasks.suites import told_in

    if options.fresh is None:
        suite = suite_given(options.suite, options.tasks_file)
    elif options.tasks_file is not None:
        raise BadInput("give --fresh or --tasks-file, not both")
    else:
        suite = fresh_suite(options.suite, options.fresh, workers or 1)
    if options.language is not None:
        suite = told_in(suite, cast("Language", options.language))
    if options.poses is not None and options.tasks_file is None:
        raise BadInput("--poses needs --tasks-file; a suite has its own poses")
    stated = {} if options.poses is None else read_poses(options.poses)
    if stated:
        tasks = tuple(with_poses(suite.tasks, stated, suite.places))
        suite = replace(suite, tasks=tasks, digest=digest(tasks))
    if options.protocol == PAPER.name:
        suite = replace(suite, tasks=tuple(with_every_pose(suite.tasks, stated)))
    return suite


def _env_kwargs(suite: Suite, options: BenchOptions, vlm_run: VLMRun | None) -> dict[str, Any]:
    """The environment's arguments: the suite's, overridden by the options that were given, and the
    observations that the agent needs. This makes agent and environment once, so that bad arguments
    are found before any worker starts."""
    from agents import make_agent
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.envs.protocol import DEFAULT, protocol_named
    from er_gym.thor import BACKENDS

    env = {"backend": "embedded", **suite.env}
    if options.protocol != DEFAULT.name:  # so that older runs, without this entry, can be continued
        env["protocol"] = options.protocol
    if protocol_named(options.protocol).chooses_instances:
        env.pop("instances", None)
    given = {"backend": options.backend, "instances": options.instances, "faults": options.faults}
    env |= {name: value for name, value in given.items() if value is not None}
    if not env.get("faults", 0):  # likewise
        env.pop("faults", None)
    if env["backend"] not in BACKENDS:
        raise ValueError(
            f"unknown backend {env['backend']!r}; choose one of: {', '.join(BACKENDS)}"
        )
    if vlm_run is None:
        env["obs_mode"] = make_agent(options.agent, seed=options.seed).obs_mode
    else:
        env |= vlm_run.env
    EmbodiedEnv((), **env)
    return env


def _vlm_run(agent: str, vlm_options: VLMOptions) -> VLMRun | None:
    """The run of a vision-language agent; None for other agents, which take none of its options."""
    from agents.factory import is_model_agent

    if is_model_agent(agent):
        return vlm_options.run(agent)
    if vlm_options.given:
        raise BadInput(
            f"{vlm_options.given[0]} is for vision-language agents, such as openai:MODEL, not for "
            f"{agent}"
        )
    return None
