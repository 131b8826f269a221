"""``er-gym tasks generate``."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import INTERRUPTED, BadInput, bad_input, print_problem
from benchmarks.cli.executor import ExecutorOptions, processors, with_executor_options
from benchmarks.cli.options import FILE, LANGUAGES, MOST_SEED, Span, force_option, split
from benchmarks.terminal import echo, terminal

if TYPE_CHECKING:
    from rich.console import Console

    from benchmarks.cli.suite_builder import BuildResult
    from er_gym.tasks.suite_spec import SuiteSpec
    from er_gym.tasks.task import Task

_DEFAULT_TOTAL = 100


@click.command()
@click.option("--suite", help="Generate this suite as its configuration says.")
@click.option(
    "--out",
    type=FILE,
    help="The task file, .jsonl or .jsonl.gz.  [default: where er-gym looks for the suite]",
)
@click.option(
    "--total", type=click.IntRange(min=1), help=f"The number of tasks.  [default: {_DEFAULT_TOTAL}]"
)
@click.option(
    "--scenes",
    metavar="NAMES",
    help="all, training, strict, evaluation, or scenes separated by commas.",
)
@click.option("--types", metavar="NAMES", help="Task types, separated by commas.  [default: all]")
@click.option(
    "--layouts", type=click.IntRange(0, 10_000), help="The number of rearrangements of each room."
)
@click.option(
    "--per-layout",
    type=click.IntRange(min=1),
    help="The number of tasks of each type in each arrangement.",
)
@click.option("--hidden-depth", type=Span(), help="How many containers must be opened.")
@click.option(
    "--distractors", type=Span(), help="How many other objects of the named types there are."
)
@click.option("--distance", type=Span(), help="How far the agent has to go, metres.")
@click.option(
    "--language",
    type=click.Choice(LANGUAGES),
    help="The language of the instructions.  [default: the suite's, or en]",
)
@click.option("--seed", type=click.IntRange(0, MOST_SEED), help="[default: the suite's, or 0]")
@click.option(
    "--paraphraser",
    metavar="MODULE:FUNCTION",
    help="A function that takes a prompt and returns a language model's reply; it adds wordings "
    "to the templates'.",
)
@force_option
@with_executor_options()
def generate(
    executor_options: ExecutorOptions, force: bool, paraphraser: str | None, **given: Any
) -> int:
    """Generate tasks, play each of them, and write those that can be done.

    The same command continues after an interruption. The same seed gives the same file. A card in
    Markdown is written beside the file.
    """
    from benchmarks.cli.suite_builder import parts_folder, remove_parts
    from benchmarks.scoring.task_counts import print_counts
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.tasks import jsonl_format
    from er_gym.writing import check_output, make_folder

    console = terminal(stderr=True)
    with bad_input():
        order = _order(paraphraser=paraphraser, **given)
        paraphrase = _paraphraser(paraphraser, order) if paraphraser else None
        make_folder(order.out.parent)
        for file in (order.out, order.card):
            check_output(file, force=force)
    parts = parts_folder(order.out, order.spec, order.seed)
    try:
        made, verified = _build(order, parts, executor_options, console)
        chosen = made.tasks
        if not chosen:
            raise click.ClickException(f"no task could be generated: {_drop_reasons(made)}")
        if paraphrase:
            doing("asking for other wordings")
            chosen = tuple(_paraphrased(task, paraphrase) for task in chosen)
        doing(f"writing {order.out}")
        _write(order, chosen, force)
    except (WorkerSetupError, RuntimeError) as error:
        raise click.ClickException(f"{error}; what is done is in {parts}") from error
    except (ValueError, OSError) as error:  # the disk is full, another file is there by now
        raise BadInput(f"{error}; what is done is in {parts}") from error
    except KeyboardInterrupt:
        done = len(list(parts.glob("*.jsonl")))
        print_problem(
            f"interrupted: {done} of {len(order.spec.rooms)} rooms are in {parts}; "
            "the same command continues"
        )
        return INTERRUPTED
    remove_parts(parts)
    doing("counting the tasks")
    print_counts(chosen, made.dropped)
    echo(f"{len(chosen)} tasks of {verified} verified: {order.out}")
    echo(f"sha256 of the tasks {jsonl_format.digest(chosen)}; card: {order.card}")
    if len(chosen) < order.spec.total:
        console.print(f"{order.spec.total} were requested; more layouts or rooms give more")
    return 0


@dataclass(frozen=True)
class _Order:
    """What to generate.

    Attributes:
        name, description: for the card.
        command: what makes it again.
    """

    name: str
    description: str
    spec: SuiteSpec
    seed: int
    out: Path
    command: str
    paraphraser: str | None

    @property
    def card(self) -> Path:
        """Where the card goes: beside the task file."""
        return self.out.with_name(f"{self.out.name.partition('.jsonl')[0]}.md")


def _order(
    *, suite: str | None, out: Path | None, seed: int | None, paraphraser: str | None, **given: Any
) -> _Order:
    """Work out what to generate: the suite's configuration, overridden by the given options."""
    from er_gym.tasks.files import validated
    from er_gym.tasks.splits import SCENES
    from er_gym.tasks.suite_spec import SuiteSpec
    from er_gym.tasks.suites import suite_config, suite_file, suite_home
    from er_gym.tasks.types import canonical_names

    told = {name: value for name, value in given.items() if value is not None}
    config = None if suite is None else suite_config(suite)
    parts = ["er-gym", "tasks", "generate", *(["--suite", suite] if suite else [])]
    parts += ["--out", out.name] if out else []
    base = config.generate.model_dump() if config and config.generate else {"total": _DEFAULT_TOTAL}
    if out is None:
        if suite is None:
            raise BadInput("give --out, or --suite to make one that er-gym knows")
        out = suite_file(suite)
        if out.parent != suite_home():
            raise BadInput(
                f"the suite {suite!r} comes with er-gym; give --out to generate it again"
            )
    if not out.name.endswith((".jsonl", ".jsonl.gz")):
        raise BadInput(
            f"--out {out}: the name of a generated task file must end in .jsonl or .jsonl.gz"
        )
    stem = out.name.removesuffix(".gz").removesuffix(".jsonl")
    for name, value in told.items():
        parts += [f"--{name.replace('_', '-')}", _option_value(value)]
    if "scenes" in told:
        base.pop("left_out", None)  # of the configuration's own scenes
    if "scenes" in told and told["scenes"] not in SCENES:
        told["scenes"] = tuple(split(told["scenes"]))
    if "types" in told:
        told["types"] = canonical_names(split(told["types"]))
    if paraphraser and told.get("language", "en") != "en":
        raise BadInput("--paraphraser asks for English wordings; leave --language out")
    seed = seed if seed is not None else config.seed if config else 0
    parts += ["--seed", str(seed), *(["--paraphraser", paraphraser] if paraphraser else [])]
    plain = config is not None and not told
    return _Order(
        name=suite if suite and plain else stem,
        description=config.description if config and plain else "Generated tasks.",
        spec=validated(SuiteSpec, {**base, **told}, "what to make"),
        seed=seed,
        out=out,
        command=shlex.join(parts),
        paraphraser=paraphraser,
    )


def _option_value(value: Any) -> str:
    """A value as an option of the command line takes it."""
    if not isinstance(value, tuple):
        return str(value)
    low, high = value
    return f"{low:g}-{'' if high is None else f'{high:g}'}"


def _build(
    order: _Order, parts: Path, options: ExecutorOptions, console: Console
) -> tuple[BuildResult, int]:
    """Build the tasks and show progress; returns the chosen ones, and how many were verified."""
    from benchmarks.cli.progress import LiveProgress
    from benchmarks.cli.suite_builder import build_suite

    rooms = len(order.spec.rooms)
    verified = done = 0
    shown = LiveProgress(console, "generating tasks", rooms)

    def on_room(scene: str, made: BuildResult) -> None:
        nonlocal verified, done
        verified, done = verified + len(made.tasks), done + 1
        shown.update(completed=done, status=f"{verified} verified, last {scene}")
        if shown.is_line_due(done):
            shown.print_line(f"{done}/{rooms} rooms, {verified} tasks verified")

    with options.workforce(shown.say, processors()) as workforce, shown:
        made = build_suite(
            order.spec,
            order.seed,
            parts=parts,
            workers=workforce.workers,
            worker_backend=workforce.worker_backend,
            on_room=on_room,
        )
    return made, verified


def _drop_reasons(made: BuildResult) -> str:
    """Why tasks were dropped, the most frequent reason first."""
    common = made.dropped.most_common(3)
    return "; ".join(f"{reason} ({count})" for reason, count in common) or "the rooms have none"


def _write(order: _Order, chosen: tuple[Task, ...], force: bool) -> None:
    """Write the task file and its card."""
    from er_gym import __version__
    from er_gym.tasks import jsonl_format
    from er_gym.tasks.suite_card import card
    from er_gym.writing import check_output, write_output

    how = {
        "suite": order.name,
        "seed": order.seed,
        "er_gym": __version__,
        **order.spec.model_dump(mode="json", exclude_defaults=True),
        **({"paraphraser": order.paraphraser} if order.paraphraser else {}),
    }
    check_output(order.card, force=force)  # before one of the two is written
    jsonl_format.write_tasks(order.out, chosen, force=force, **how)
    text = card(order.name, order.description, chosen, how, order.command)
    write_output(order.card, text, force=force)


def _paraphraser(spec: str, order: _Order) -> Any:
    from er_gym.tasks.paraphrase import Paraphraser, load_ask

    ask = load_ask(spec)

    def asked(prompt: str) -> str:
        try:
            reply = ask(prompt)
        except (Exception, SystemExit) as error:  # the user's function may raise anything
            raise RuntimeError(f"{spec} raised {type(error).__name__}: {error}") from error
        if not isinstance(reply, str):
            raise RuntimeError(
                f"{spec} returned {type(reply).__name__}; it must return the reply as str"
            )
        return reply

    return Paraphraser(asked, order.out.with_name(f"{order.name}.paraphrases.jsonl"))


def _paraphrased(task: Task, paraphrase: Any) -> Task:
    """The task with a wording drawn from the template's and the language model's."""
    from dataclasses import replace

    from er_gym.tasks.paraphrase import choose, names_in

    kept = {*names_in(task.name), *_switch_words(task)}
    variants = paraphrase(task.name, kept)
    return replace(
        task, instruction=choose((task.instruction, *variants), f"{task.id} in other words")
    )


def _switch_words(task: Task) -> set[str]:
    """The words "on" and "off" where the task's name uses them of a goal."""
    states: Mapping[object, str] = {True: "on", False: "off"}
    ways = {
        states[value]
        for condition in task.goal
        for name, value in condition.state
        if name == "isToggled"
    }
    words = set(task.name.lower().replace(".", " ").replace("?", " ").split())
    return ways & words
