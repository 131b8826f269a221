"""The output files of scripts."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import click

from er_gym.writing import check_output, write_output

FORMAT = "er-gym/figures/1"


class Output(click.Path):
    """A file to write, checked before anything is measured; files of other programs are not
    replaced.
    """

    def __init__(self) -> None:
        super().__init__(dir_okay=False, path_type=Path)

    def convert(self, value: Any, param: Any, ctx: Any) -> Any:
        """The path; click ends the script with exit code 2 if it cannot be written."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        try:
            check_output(path)
        except (OSError, ValueError) as error:
            self.fail(str(error), param, ctx)
        return path


def write_figures(file: Path, figures: object) -> None:
    """Write figures as JSON: ``{"format": "er-gym/figures/1", "figures": …}``.

    Raises:
        click.ClickException: they cannot be written.
    """
    text = json.dumps({"format": FORMAT, "figures": figures}, indent=1) + "\n"
    try:
        write_output(file, text)
    except (OSError, ValueError) as error:
        raise click.ClickException(str(error)) from error
