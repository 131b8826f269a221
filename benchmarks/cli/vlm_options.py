"""The options of ``er-gym bench`` and ``er-gym collect`` for models."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

import click

from benchmarks.cli.options import (
    EXISTING_FILE,
    Finite,
    Words,
    agent_config_option,
    overrides_option,
)


@dataclass(frozen=True)
class VLMOptions:
    """The options for a model: its settings, its server, and what it may spend."""

    agent_config: str | None = None
    overrides: Sequence[str] = ()
    base_url: Sequence[str] = ()
    prompts_from: Path | None = None
    concurrency: int | None = None
    max_usd: float | None = None
    max_tokens: int | None = None
    max_minutes: float | None = None

    @property
    def given(self) -> list[str]:
        """The options that the command line names."""
        fields = [name for name, value in vars(self).items() if value not in (None, ())]
        return [
            "--set" if name == "overrides" else f"--{name.replace('_', '-')}" for name in fields
        ]


_VLM_OPTIONS = (
    agent_config_option,
    overrides_option("sampling.temperature=0.7"),
    click.option(
        "--base-url",
        type=Words(),
        multiple=True,
        metavar="URL",
        help="The address of the model's server. Repeat it for several servers with the same "
        "model: each request goes to the one with the fewest under way.",
    ),
    click.option(
        "--prompts-from",
        type=EXISTING_FILE,
        metavar="DATASET",
        help="Take the prompts from a training file in the paper's format.",
    ),
    click.option(
        "--concurrency",
        type=click.IntRange(1, 1000),
        help="The number of simultaneous conversations.  [default: 8]",
    ),
    click.option(
        "--max-usd",
        type=Finite(min=0, min_open=True),
        help="Stop after spending this many US dollars.",
    ),
    click.option("--max-tokens", type=int, help="Stop after this many tokens."),
    click.option(
        "--max-minutes",
        type=Finite(min=0, min_open=True),
        help="Stop after this many minutes, even within a request.",
    ),
)
"""For vision-language agents. The budgets limit the whole run, however often it is continued; the
minutes limit this command."""


def with_vlm_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add these options to a command, which gets them as one argument ``vlm_options``."""

    def with_options(**given: Any) -> Any:
        vlm_options = VLMOptions(
            **{name: given.pop(name) for name in VLMOptions.__dataclass_fields__}
        )
        return command(vlm_options=vlm_options, **given)

    with_options.__doc__ = command.__doc__
    return reduce(lambda made, option: option(made), reversed(_VLM_OPTIONS), with_options)
