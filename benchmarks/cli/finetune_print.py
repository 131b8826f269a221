"""``er-gym finetune --print``: the files with which another program makes the run."""

from __future__ import annotations

from pathlib import Path

import click

from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import Place, overrides_option
from benchmarks.cli.terminal import echo

PRINTABLE = ("llama-factory", "ms-swift", "trl", "deepspeed")
"""As in ``agents.finetune.printing``, which is too slow to import for ``--help``; a test
compares."""


def print_run(
    program: str,
    config: str,
    overrides: tuple[str, ...],
    model: str,
    data: Path,
    out: Path,
    *,
    gpus: int | None = None,
    copy: bool = False,
) -> None:
    """Write the files and name them; see :func:`agents.finetune.printing.write_files`.

    Raises:
        BadInput: whatever the user got wrong.
    """
    from agents.finetune.printing import write_files
    from agents.finetune.settings import load_settings

    with bad_input():
        settings = load_settings(config, overrides)
        files = write_files(program, settings, model, data, out, gpus=gpus, copy=copy)
    for file in files:
        echo(file)


@click.command(name="finetune")
@click.option("--print", "program", required=True, type=click.Choice(PRINTABLE))
@click.option("--config", required=True, metavar="FILE", help="The settings, such as stage1.")
@overrides_option("training.epochs=2 or model.lora.rank=16")
@click.option("--model", required=True, metavar="MODEL", help="Such as qwen2-vl-7b.")
@click.option("--data", required=True, type=Place(path_type=Path), help="What is learnt.")
@click.option("--out", required=True, type=Place(file_okay=False, path_type=Path))
@click.option("--gpus", type=click.IntRange(min=1), help="[default: 8, with LoRA 1]")
@click.option("--copy", is_flag=True, help="Copy pictures; else they are hard links.")
def finetune_print(
    program: str,
    config: str,
    overrides: tuple[str, ...],
    model: str,
    data: Path,
    out: Path,
    gpus: int | None,
    copy: bool,
) -> None:
    """Write the files of a run for another program."""
    print_run(program, config, overrides, model, data, out, gpus=gpus, copy=copy)
