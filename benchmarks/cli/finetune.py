"""``er-gym finetune``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import INTERRUPTED, BadInput, bad_input, needing, print_problem
from benchmarks.cli.options import Place, Words, overrides_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from agents.finetune.loop import Progress
    from agents.finetune.settings import FinetuneSettings
    from agents.finetune.train import Result

PRINTABLE = ("llama-factory", "ms-swift", "trl", "deepspeed")
"""As in ``agents.finetune.printing``, which is too slow to import for ``--help``; a test
compares."""


@click.command()
@click.option(
    "--config",
    required=True,
    metavar="FILE",
    help="The settings: a YAML file, or the name of one that comes with er-gym, such as stage1.",
)
@overrides_option("training.epochs=2 or model.lora.rank=16")
@click.option(
    "--model",
    required=True,
    type=Words(),
    metavar="DIR",
    help="The model: a directory that save_pretrained wrote, or an earlier run; for --print also a "
    "name such as qwen2-vl-7b.",
)
@click.option(
    "--data",
    required=True,
    multiple=True,
    type=Place(path_type=Path),
    metavar="PATH",
    help="What is learnt: a collection of er-gym collect, or a ShareGPT file; may be repeated.",
)
@click.option(
    "--out",
    required=True,
    type=Place(file_okay=False, path_type=Path),
    help="The run directory; the same command again continues it.",
)
@click.option(
    "--ignore-memory",
    is_flag=True,
    help="Train although by the estimate it does not fit into the memory.",
)
@click.option(
    "--print",
    "program",
    type=click.Choice(PRINTABLE),
    help="Train nothing; write the complete files with which this program makes the run.",
)
@click.option(
    "--gpus", type=click.IntRange(min=1), help="With --print: how many GPUs.  [default: 8, LoRA 1]"
)
@click.option("--copy", is_flag=True, help="With --print: copy pictures instead of linking them.")
def finetune(
    config: str,
    overrides: tuple[str, ...],
    model: str,
    data: tuple[Path, ...],
    out: Path,
    ignore_memory: bool,
    program: str | None,
    gpus: int | None,
    copy: bool,
) -> int:
    """Fine-tune a language or vision-language model on trajectories; needs the extra finetune.

    On several GPUs: accelerate launch -m benchmarks.cli finetune … The same command again continues
    from the last checkpoint. `er-gym bench --agent hf:RUN/model` plays with the result.
    """
    from agents.finetune.settings import load_settings
    from er_gym.activity import begin_import

    with bad_input():
        settings = load_settings(config, overrides)
    if program is not None:
        _print_run(program, settings, model, data, out, gpus, copy)
        return 0
    if gpus is not None or copy:
        raise BadInput("--gpus and --copy are for --print; leave them out")
    begin_import("PyTorch, transformers and peft", "torch", "transformers", "peft")
    with needing("fine-tuning", "er-gym[finetune]"):
        from agents.finetune import train as training
    try:
        with bad_input():
            result = training.train(
                settings,
                Path(model),
                data,
                out,
                ignore_memory=ignore_memory,
                report=_say_progress,
                say=lambda text: echo(text, err=True),
            )
    except (RuntimeError, MemoryError) as error:
        raise click.ClickException(
            f"{error}; the same command continues from the last checkpoint, if there is one"
        ) from error
    except KeyboardInterrupt:
        kept = out.exists()
        left = f"the same command continues from the last checkpoint in {out}" if kept else ""
        print_problem(
            f"interrupted; {left or 'nothing had been saved, and nothing is left behind'}"
        )
        return INTERRUPTED
    if training.machine.is_first():
        _say_result(result)
    return 0


def _print_run(
    program: str,
    settings: FinetuneSettings,
    model: str,
    data: tuple[Path, ...],
    out: Path,
    gpus: int | None,
    copy: bool,
) -> None:
    """Write the files of another program's run, and name them."""
    from er_gym.activity import begin_import

    begin_import("PyTorch and transformers", "torch", "transformers")
    from agents.finetune.printing import write_files

    if len(data) > 1:
        raise BadInput(f"--print takes one --data, not {len(data)}; print a run for each")
    with bad_input():
        files = write_files(program, settings, model, data[0], out, gpus=gpus, copy=copy)
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
