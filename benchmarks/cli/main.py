"""The command ``er-gym``.

Only click is imported before a subcommand runs, so that ``er-gym --help`` is instant. Whatever the
user got wrong ends the command with exit code 2 and one line on stderr.
"""

from __future__ import annotations

import atexit
import gc
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

import click

from benchmarks.cli.activity import doing, new_modules, showing_activity
from benchmarks.cli.bench import bench
from benchmarks.cli.collect import collect
from benchmarks.cli.data import data
from benchmarks.cli.doctor import doctor
from benchmarks.cli.errors import (
    INTERRUPTED,
    BadInput,
    bad_input,
    interrupted_by_sigterm,
    print_problem,
)
from benchmarks.cli.finetune import finetune
from benchmarks.cli.houses import houses
from benchmarks.cli.inspect import inspect
from benchmarks.cli.leaderboard import leaderboard, submit
from benchmarks.cli.new_model import new_model
from benchmarks.cli.options import FOLDER, scorer_option
from benchmarks.cli.player import player
from benchmarks.cli.plugs import mcp, openenv
from benchmarks.cli.prompts import prompts
from benchmarks.cli.reinforce import reinforce
from benchmarks.cli.render import play, render
from benchmarks.cli.replay import replay
from benchmarks.cli.serve import match_server, serve
from benchmarks.cli.study import ablate, ladder
from benchmarks.cli.tasks import tasks
from benchmarks.cli.train import train_rl
from benchmarks.cli.ui import ui
from benchmarks.cli.unity import unity
from benchmarks.cli.zoo import zoo
from benchmarks.terminal import echo, stdout, terminal, use_any_encoding

FORMATS = ("table", "md", "csv", "json")


def main(args: Sequence[str] | None = None) -> NoReturn:
    """Run the command and exit: 0; 2 for bad input; others as in ``benchmarks.cli.errors``."""
    use_any_encoding()
    # At its end Python looks through all objects for cycles, in seconds where torch is loaded.
    atexit.register(gc.freeze)
    atexit.register(_end_by_exit_code)
    try:
        with interrupted_by_sigterm(), showing_activity():
            code = cli.main(args=args, prog_name="er-gym", standalone_mode=False)
    except click.UsageError as error:
        help_command = f"{error.ctx.command_path if error.ctx else 'er-gym'} --help"
        print_problem(f"{error.format_message().rstrip('.')}; see {help_command}")
        sys.exit(error.exit_code)
    except click.ClickException as error:
        print_problem(error.format_message())
        sys.exit(error.exit_code)
    except ValueError as error:
        # Not imported at the top: a broken plugin package would make er_gym fail to import.
        plugins = sys.modules.get("er_gym.plugins")
        if plugins is None or not isinstance(error, plugins.PluginError):
            raise
        print_problem(str(error))
        sys.exit(BadInput.exit_code)
    except (click.Abort, KeyboardInterrupt):
        print_problem("interrupted")
        sys.exit(INTERRUPTED)
    except OSError as error:  # a full disk, a directory that has gone
        print_problem(str(error))
        sys.exit(1)
    except MemoryError as error:
        print_problem(f"there is not enough memory: {error}".rstrip(": "))
        sys.exit(1)
    sys.exit(code if isinstance(code, int) else 0)


def _end_by_exit_code() -> None:
    """Let ``python -m`` end with the exit code of :func:`main`, also after Ctrl-C.

    Python remembers a Ctrl-C that ended text given to ``exec``, of which a dataclass is made, even
    if it was caught outside; a program begun by ``-m`` then ends by SIGINT. The next such text
    makes Python forget it.
    """
    exec("")


@click.group(invoke_without_command=True, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--version", is_flag=True, is_eager=True, help="Show the version and exit.")
@click.pass_context
def cli(context: click.Context, version: bool) -> None:
    """Embodied reasoning tasks in AI2-THOR rooms: play them, score them, report."""
    context.obj = main  # for commands that run others
    if version:
        from er_gym import __version__

        echo(f"er-gym {__version__}")
        context.exit()
    if context.invoked_subcommand is None:
        echo(context.get_help())
    else:
        doing(f"{context.invoked_subcommand}: loading er-gym", new_modules())


cli.add_command(bench)
cli.add_command(collect)
cli.add_command(player)
cli.add_command(unity)
cli.add_command(doctor)
cli.add_command(render)
cli.add_command(play)
cli.add_command(replay)
cli.add_command(tasks)
cli.add_command(houses)
cli.add_command(train_rl)
cli.add_command(finetune)
cli.add_command(reinforce)
cli.add_command(serve)
cli.add_command(match_server)
cli.add_command(inspect)
cli.add_command(data)
cli.add_command(prompts)
cli.add_command(ladder)
cli.add_command(ablate)
cli.add_command(ui)
cli.add_command(new_model)
cli.add_command(zoo)
cli.add_command(submit)
cli.add_command(leaderboard)
cli.add_command(openenv)
cli.add_command(mcp)


@cli.command()
@click.argument("runs", nargs=-1, required=True, metavar="RUN...", type=FOLDER)
@click.option("--format", "layout", type=click.Choice(FORMATS), default="table", show_default=True)
@scorer_option
@click.option("--by-type", is_flag=True, help="Add every metric for each group and task type.")
@click.option(
    "--by-split",
    is_flag=True,
    help="Add success by whether the tasks' rooms and objects are those of the training tasks.",
)
@click.option("--misses", is_flag=True, help="Add the episodes without success, and why.")
def report(
    runs: tuple[Path, ...], layout: str, scorer: str, by_type: bool, by_split: bool, misses: bool
) -> None:
    """Show the results in one or several run directories.

    Rates have Wilson's 95 % interval. The json format carries every metric, slice, score and miss,
    whatever the other options, but no splits.
    """
    from benchmarks.scoring import report as reports
    from benchmarks.scoring.splits import split_results, split_table
    from benchmarks.scoring.tables import print_tables, tables
    from er_gym.tables import as_markdown

    for name, given, refused in (
        ("--misses", misses, ("csv",)),
        ("--by-split", by_split, ("csv", "json")),
    ):
        if given and layout in refused:
            fitting = [each for each in FORMATS if each not in refused]
            raise BadInput(
                f"{name} does not go with --format {layout}, which lacks it; choose "
                f"{', '.join(fitting)}"
            )
    loaded = []
    with bad_input():
        for path in runs:
            doing(f"reading the episodes of {path}")
            loaded.append(reports.load_run(path))
    doing("computing the tables")
    if layout == "json":
        echo(reports.as_json(loaded))
    elif layout == "csv":
        echo(reports.as_csv(loaded, scorer, by_type), nl=False)
    else:
        found = tables(loaded, scorer=scorer, with_types=by_type, with_misses=misses)
        if by_split:
            found.append(split_table(split_results(loaded)))
        if layout == "md":
            echo(as_markdown(found), nl=False)
        else:
            print_tables(found, stdout())


@cli.command()
def suites() -> None:
    """List the suites."""
    from collections import Counter

    from er_gym.tasks.suites import (
        load_suite,
        suite_config,
        suite_file,
        suite_names,
        suite_registry,
    )
    from er_gym.tasks.types import GROUPS

    for name in suite_registry().names():
        doing(f"reading the suite {name}")
        if name in suite_names() and not suite_file(name).exists():
            echo(
                f"{name}: not made yet (er-gym tasks generate --suite {name}); "
                f"{suite_config(name).description}"
            )
            continue
        with bad_input():
            tasks = load_suite(name).tasks
        counts = Counter(task.type.group for task in tasks)
        groups = ", ".join(f"{group} {counts[group]}" for group in GROUPS if counts[group])
        echo(f"{name}: {len(tasks)} tasks ({groups})")


@cli.command()
def envs() -> None:
    """List the registered environments, one for each task type.

    Options that take a task type accept each of its names: its id, the title and the names that
    this command prints after it, or the group for all of its types. Upper and lower case, hyphens,
    underscores and spaces make no difference.
    """
    from er_gym.tasks.types import BY_NAME, GROUPS, short_name

    widest = max(len(kind.env_id) for kind in BY_NAME.values())
    for kind in BY_NAME.values():
        names = dict.fromkeys((kind.name, short_name(kind)))
        echo(
            f"{kind.env_id:{widest}}  {kind.group}: {kind.title}, {kind.max_steps} steps; "
            f"{', '.join(names)}"
        )
    terminal(stderr=True).print(
        f"As a type, give any of these names, or a group: {', '.join(GROUPS)}. "
        "Case, hyphens and underscores do not matter.",
        style="dim",
        soft_wrap=True,
    )


if __name__ == "__main__":
    main()
