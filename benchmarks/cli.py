"""The command ``er-gym``.

Only click is imported before a subcommand runs, so that ``er-gym --help`` is instant. Whatever the
user got wrong ends the command with exit code 2 and one line on stderr.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from benchmarks.cli_errors import BadInput, bad_input
from benchmarks.cli_options import split
from benchmarks.cli_player import doctor, player
from benchmarks.cli_render import play, render
from benchmarks.cli_tasks import tasks
from benchmarks.cli_train import train_rl

if TYPE_CHECKING:
    from rich.console import Console

    from er_gym.tasks.suites import Suite


FORMATS = ("table", "md", "csv", "json")
SCORER_CHOICES = ("both", "paper", "corrected")
"""As in ``benchmarks.report``, which is too heavy to import for ``--help``; a test compares."""

CRASHED, INTERRUPTED = 1, 130

_existing_file = click.Path(exists=True, dir_okay=False, path_type=Path)
_directory = click.Path(file_okay=False, path_type=Path)
_scorer = click.option(
    "--scorer",
    type=click.Choice(SCORER_CHOICES),
    default="both",
    show_default=True,
    help="Which scorer the table shows; both: each where they differ.",
)


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command and exit: 0; 1 if episodes crashed; 2 for bad input; 130 after Ctrl-C."""
    try:
        code = cli.main(args=args, prog_name="er-gym", standalone_mode=False)
    except click.UsageError as error:
        help_command = f"{error.ctx.command_path if error.ctx else 'er-gym'} --help"
        _complain(f"{error.format_message().rstrip('.')}; see {help_command}")
        sys.exit(error.exit_code)
    except click.ClickException as error:
        _complain(error.format_message())
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        _complain("interrupted")
        sys.exit(INTERRUPTED)
    sys.exit(code if isinstance(code, int) else 0)


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, help="Show the version and exit.")
@click.pass_context
def cli(context: click.Context, version: bool) -> None:
    """Embodied reasoning tasks in AI2-THOR rooms: play them, score them, report."""
    if version:
        from er_gym import __version__

        click.echo(f"er-gym {__version__}")
        context.exit()
    if context.invoked_subcommand is None:
        click.echo(context.get_help())


cli.add_command(player)
cli.add_command(doctor)
cli.add_command(render)
cli.add_command(play)
cli.add_command(tasks)
cli.add_command(train_rl)


@cli.command()
@click.option("--suite", help="A bundled suite; `er-gym suites` lists them.")
@click.option("--tasks-file", type=_existing_file, help="Tasks in the paper's file format.")
@click.option("--poses", type=_existing_file, help="Exact poses, in the paper's file format.")
@click.option("--agent", required=True, help="Who plays, such as oracle or random.")
@click.option("--out", type=_directory, help="The run directory.  [default: runs/SUITE-AGENT]")
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True)
@click.option("--limit", type=click.IntRange(min=1), help="Play no more than the first N tasks.")
@click.option("--task-ids", multiple=True, metavar="ID,…", help="Play these; may be repeated.")
@click.option("--shard", metavar="I/N", help="Play the I-th of N parts, such as 2/8.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
@click.option("--backend", help="The engine: embedded or unity.  [default: the suite's]")
@click.option("--instances", help="What a type name stands for.  [default: the suite's]")
@_scorer
def bench(
    suite: str | None,
    tasks_file: Path | None,
    poses: Path | None,
    agent: str,
    out: Path | None,
    workers: int,
    limit: int | None,
    task_ids: tuple[str, ...],
    shard: str | None,
    seed: int,
    backend: str | None,
    instances: str | None,
    scorer: str,
) -> int:
    """Play a suite with an agent and print the result table.

    The same command again continues: episodes that are done are not played again.
    """
    from rich.console import Console

    from benchmarks.metrics import CORRECTED, SCORERS, score_episode
    from benchmarks.pool import WorkerSetupError
    from benchmarks.progress import Progress
    from benchmarks.report import load_run
    from benchmarks.runner import Shard, finished, run, select
    from benchmarks.store import Manifest, RunStore, file_stem
    from benchmarks.tables import print_tables, tables
    from er_gym import __version__
    from er_gym.tasks.resolve import resolve_tasks
    from er_gym.thor import BackendError

    terminal = Console(stderr=True)
    with bad_input(BackendError):
        part = Shard.parse(shard) if shard else None
        asked = _load_suite(suite, tasks_file, poses)
        env = _env_kwargs(asked, agent, seed, backend=backend, instances=instances)
        all_tasks, notes = resolve_tasks(asked.tasks, env["backend"])
        chosen = select(all_tasks, task_ids=split(*task_ids), shard=part, limit=limit)
        out = out or Path("runs") / f"{file_stem(asked.name)}-{file_stem(agent)}"
        manifest = Manifest(
            suite=asked.name,
            suite_digest=asked.digest,
            suite_size=len(all_tasks),
            agent=agent,
            env=env,
            seed=seed,
            er_gym=__version__,
        )
        store = RunStore.create(out, manifest)
    for note in notes:
        terminal.print(note, style="dim", markup=False, highlight=False, soft_wrap=True)

    judge = SCORERS.get(scorer, CORRECTED)
    before = finished(store, chosen)
    succeeded = sum(score_episode(episode, judge).success for episode in before)
    progress = Progress(terminal, f"{asked.name}, {agent}", len(chosen), len(before), succeeded)
    try:
        with progress:
            outcome = run(
                store,
                chosen,
                workers=workers,
                on_episode=lambda episode: progress.episode(score_episode(episode, judge).success),
            )
    except (WorkerSetupError, OSError) as error:  # OSError: the disk is full, the share is gone
        raise click.ClickException(f"{error}; the episodes done are in {out}") from error
    except KeyboardInterrupt:
        _complain(
            f"interrupted: {len(finished(store, chosen))} of {len(chosen)} episodes are in {out}; "
            "the same command continues"
        )
        return INTERRUPTED
    print_tables(tables([load_run(out)], scorer=scorer), _stdout())
    if outcome.crashed:
        first = outcome.crashed[0]
        _complain(
            f"{len(outcome.crashed)} of {outcome.played} episodes crashed, the first of them "
            f"{first.task_id}: {first.error}; the same command plays them again"
        )
        return CRASHED
    return 0


@cli.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=_directory)
@click.option("--format", "layout", type=click.Choice(FORMATS), default="table", show_default=True)
@_scorer
@click.option("--by-type", is_flag=True, help="Add every metric for each group and task type.")
@click.option("--misses", is_flag=True, help="Add the episodes without success, and why.")
def report(runs: tuple[Path, ...], layout: str, scorer: str, by_type: bool, misses: bool) -> None:
    """Show the results in one or several run directories.

    Rates have Wilson's 95 % interval. The json format carries every metric, slice, score and miss,
    whatever the other options.
    """
    from benchmarks import report as reports
    from benchmarks.tables import as_markdown, print_tables, tables

    if misses and layout == "csv":
        raise BadInput(
            "--misses does not go with --format csv, which holds means; choose json, md or table"
        )
    with bad_input():
        loaded = [reports.load_run(path) for path in runs]
    if layout == "json":
        click.echo(reports.as_json(loaded))
    elif layout == "csv":
        click.echo(reports.as_csv(loaded, scorer, by_type), nl=False)
    else:
        found = tables(loaded, scorer=scorer, with_types=by_type, with_misses=misses)
        if layout == "md":
            click.echo(as_markdown(found), nl=False)
        else:
            print_tables(found, _stdout())


@cli.command()
def suites() -> None:
    """List the suites."""
    from collections import Counter

    from er_gym.tasks.suites import load_suite, suite_config, suite_file, suite_names
    from er_gym.tasks.types import GROUPS

    for name in suite_names():
        if not suite_file(name).exists():
            click.echo(
                f"{name}: not made yet (er-gym tasks generate --suite {name}); "
                f"{suite_config(name).description}"
            )
            continue
        with bad_input():
            tasks = load_suite(name).tasks
        counts = Counter(task.type.group for task in tasks)
        groups = ", ".join(f"{group} {counts[group]}" for group in GROUPS if counts[group])
        click.echo(f"{name}: {len(tasks)} tasks ({groups})")


@cli.command()
def envs() -> None:
    """List the registered environments, one for each task type."""
    from er_gym.tasks.types import TASK_TYPES

    widest = max(len(kind.env_id) for kind in TASK_TYPES)
    for kind in TASK_TYPES:
        click.echo(f"{kind.env_id:{widest}}  {kind.group}: {kind.title}, {kind.max_steps} steps")


def _load_suite(name: str | None, tasks_file: Path | None, poses: Path | None) -> Suite:
    from er_gym.tasks.jsonl_format import digest
    from er_gym.tasks.paper_format import read_poses, with_poses
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    if (name is None) == (tasks_file is None):
        raise BadInput(f"give either --suite (one of: {', '.join(suite_names())}) or --tasks-file")
    if name is not None:
        if poses is not None:
            raise BadInput("--poses goes with --tasks-file; a suite has its own")
        return load_suite(name)
    assert tasks_file is not None
    suite = suite_from_file(tasks_file)
    if poses is None:
        return suite
    tasks = tuple(with_poses(suite.tasks, read_poses(poses)))
    return replace(suite, tasks=tasks, digest=digest(tasks))


def _env_kwargs(suite: Suite, agent: str, seed: int, **given: str | None) -> dict[str, Any]:
    """The environment's arguments: the suite's, overruled by the options that were given, and the
    observations that the agent needs. Agent and environment are made once, to hear of what is wrong
    with them before any worker is started."""
    from agents import make_agent
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.thor import BACKENDS

    env = {"backend": "embedded", **suite.env}
    env |= {name: value for name, value in given.items() if value is not None}
    if env["backend"] not in BACKENDS:
        raise ValueError(
            f"unknown backend {env['backend']!r}; choose one of: {', '.join(BACKENDS)}"
        )
    env["obs_mode"] = make_agent(agent, seed=seed).obs_mode
    EmbodiedEnv((), **env)
    return env


def _stdout() -> Console:
    """Tables are as wide as the terminal, and as wide as they need to be in a file."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 240)


def _complain(message: str) -> None:
    click.echo(f"er-gym: {' '.join(message.split())}", err=True)


if __name__ == "__main__":
    main()
