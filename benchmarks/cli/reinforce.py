"""``er-gym reinforce``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import INTERRUPTED, bad_input, needing, print_problem
from benchmarks.cli.options import (
    FOLDER,
    PATH,
    OptionGroup,
    Words,
    option,
    overrides_option,
    shared_option,
    with_options,
)
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from agents.reinforce.train import Progress, Result


@dataclass(frozen=True)
class ReinforceOptions(OptionGroup):
    """Which model learns on which tasks, and where the run is written."""

    config: str = option(
        required=True,
        metavar="FILE",
        help="The settings: a YAML file, or the name of one that comes with er-gym, such as "
        "er-tiny-text.",
    )
    overrides: tuple[str, ...] = shared_option(
        overrides_option("training.updates=50 or model.lora.rank=16")
    )
    model: str = option(
        required=True,
        type=Words(),
        metavar="DIR",
        help="The model: a directory that save_pretrained wrote with its agent.yaml, an earlier "
        "run, or zoo:NAME.",
    )
    suite: str | None = option(
        metavar="NAME", help="The suite whose tasks it plays, such as train."
    )
    tasks_file: Path | None = option(
        "--tasks-file", type=PATH, help="A task file in place of a suite."
    )
    out: Path = option(
        required=True,
        type=FOLDER,
        help="The run directory; the same command again continues it.",
    )


@click.command()
@with_options(options=ReinforceOptions)
def reinforce(options: ReinforceOptions) -> int:
    """Let a language model learn from the rewards of its own episodes; needs the extra finetune.

    On several GPUs: accelerate launch -m benchmarks.cli reinforce … The same command again
    continues from the last checkpoint. `er-gym bench --agent hf:RUN` plays with the result.
    """
    from agents.reinforce.settings import load_settings
    from benchmarks.cli.suites import suite_given
    from er_gym.activity import begin, begin_import

    with bad_input():
        settings = load_settings(options.config, options.overrides)
        model = _model(options.model)
        begin("reading the tasks")
        suite = suite_given(options.suite, options.tasks_file)
    begin_import("PyTorch, transformers and peft", "torch", "transformers", "peft")
    with needing("reinforcement", "er-gym[finetune]"):
        from agents.reinforce import train as training
    try:
        with bad_input():
            result = training.reinforce(
                settings,
                model,
                suite,
                options.out,
                report=_say_progress,
                say=lambda text: echo(text, err=True),
            )
    except (RuntimeError, MemoryError) as error:
        raise click.ClickException(
            f"{error}; the same command continues from the last checkpoint, if there is one"
        ) from error
    except KeyboardInterrupt:
        kept = options.out.exists()
        left = f"the same command continues from the last checkpoint in {options.out}"
        print_problem(
            f"interrupted; {left if kept else 'nothing had been saved, and nothing is left behind'}"
        )
        return INTERRUPTED
    if training.machine.is_first():
        _say_result(result)
    return 0


def _model(given: str) -> Path:
    """The directory of a model, or of a model of the zoo.

    Raises:
        ValueError: the zoo has no such model, or it is no language model.
    """
    from agents.zoo.index import PREFIX, find_model

    if not given.startswith(PREFIX):
        return Path(given)
    found = find_model(given.removeprefix(PREFIX))
    if found.card.kind != "language model":
        raise ValueError(f"{given} is a {found.card.kind}; er-gym train-rl trains such models")
    return found.folder


def _say_progress(progress: Progress) -> None:
    left = int(progress.seconds_left)
    checked = progress.validation
    echo(
        f"update {progress.update:,} of {progress.updates:,}  success {progress.success:.1%}  "
        f"reward {progress.reward:.3f}  "
        + ("" if checked is None else f"validation {checked:.1%}  ")
        + f"{left // 3600}:{left // 60 % 60:02}:{left % 60:02} left",
        err=True,
    )


def _say_result(result: Result) -> None:
    state = "" if result.new else "finished already: "
    checked = ""
    if result.validation:
        first, last = result.validation
        checked = f", validation {first:.1%} to {last:.1%}"
    echo(
        f"{state}{result.episodes:,} episodes, {result.updates:,} updates{checked}; the model is "
        f"that of update {result.kept:,}: {result.path / 'model'}"
    )
    echo(f"er-gym bench --suite mini --agent hf:{result.path}")
