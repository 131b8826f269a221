"""``er-gym finetune``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import INTERRUPTED, BadInput, bad_input, needing, print_problem
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
    from agents.finetune.loop import Progress
    from agents.finetune.settings import FinetuneSettings
    from agents.finetune.train import Result

PRINTABLE = ("llama-factory", "ms-swift", "trl", "deepspeed")
"""As in ``agents.finetune.launchers``, which is too slow to import for ``--help``; a test
compares."""


@dataclass(frozen=True)
class FinetuneOptions(OptionGroup):
    """What is trained, on what, and where the run is written."""

    config: str = option(
        required=True,
        metavar="FILE",
        help="The settings: a YAML file, or the name of one that comes with er-gym, such as "
        "stage1.",
    )
    overrides: tuple[str, ...] = shared_option(
        overrides_option("training.epochs=2 or model.lora.rank=16")
    )
    model: str = option(
        required=True,
        type=Words(),
        metavar="DIR",
        help="The model: a directory that save_pretrained wrote, or an earlier run; for --print "
        "also a name such as qwen2-vl-7b.",
    )
    data: tuple[Path, ...] = option(
        required=True,
        multiple=True,
        type=PATH,
        metavar="PATH",
        help="The training data: a collection, frames, or a ShareGPT file; may be repeated.",
    )
    out: Path = option(
        required=True,
        type=FOLDER,
        help="The run directory; the same command again continues it.",
    )
    ignore_memory: bool = option(
        is_flag=True, help="Train even if the estimate says that the memory is too small."
    )
    program: str | None = option(
        "--print",
        type=click.Choice(PRINTABLE),
        help="Train nothing; write all files that this program needs for the run.",
    )
    gpus: int | None = option(
        type=click.IntRange(min=1),
        help="With --print: the number of GPUs.  [default: 8, LoRA 1]",
    )
    copy: bool = option(is_flag=True, help="With --print: copy pictures instead of linking them.")


@click.command()
@with_options(options=FinetuneOptions)
def finetune(options: FinetuneOptions) -> int:
    """Fine-tune a language or vision-language model on trajectories; needs the extra finetune.

    On several GPUs: accelerate launch -m benchmarks.cli finetune … The same command again continues
    from the last checkpoint. `er-gym bench --agent hf:RUN/model` plays with the result.
    """
    from agents.finetune.settings import load_settings
    from er_gym.activity import begin_import

    with bad_input():
        settings = load_settings(options.config, options.overrides)
    if options.program is not None:
        _print_run(options.program, settings, options)
        return 0
    if options.gpus is not None or options.copy:
        raise BadInput("--gpus and --copy are for --print; leave them out")
    begin_import("PyTorch, transformers and peft", "torch", "transformers", "peft")
    with needing("fine-tuning", "er-gym[finetune]"):
        from agents.finetune import train as training
    try:
        with bad_input():
            result = training.train(
                settings,
                Path(options.model),
                options.data,
                options.out,
                ignore_memory=options.ignore_memory,
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


def _print_run(program: str, settings: FinetuneSettings, options: FinetuneOptions) -> None:
    """Write the files of another program's run, and name them."""
    from er_gym.activity import begin_import

    begin_import("PyTorch and transformers", "torch", "transformers")
    from agents.finetune.launchers import write_files

    data, *more = options.data
    if more:
        raise BadInput(f"--print takes one --data, not {len(options.data)}; print a run for each")
    with bad_input():
        files = write_files(
            program,
            settings,
            options.model,
            data,
            options.out,
            gpus=options.gpus,
            copy=options.copy,
        )
    for file in files:
        echo(file)


def _say_progress(progress: Progress) -> None:
    left = int(progress.seconds_left)
    echo(
        f"update {progress.update:,} of {progress.updates:,}  loss {progress.loss:.4f}  "
        f"{progress.tokens_per_second:,.0f} tokens/s  "
        f"{left // 3600}:{left // 60 % 60:02}:{left % 60:02} left  "
        f"{progress.memory / (1 << 30):.1f} GiB",
        err=True,
    )


def _say_result(result: Result) -> None:
    state = "" if result.new else "finished already: "
    echo(
        f"{state}{result.conversations:,} conversations, {result.updates:,} updates, loss "
        f"{result.first_loss:.4f} to {result.loss:.4f}: {result.path / 'model'}"
    )
    echo(f"er-gym bench --suite mini --agent hf:{result.path / 'model'}")
