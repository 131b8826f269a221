"""The options of ``er-gym bench``, ``er-gym collect`` and ``er-gym ui`` for models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.options import (
    EXISTING_FILE,
    Finite,
    OptionGroup,
    Words,
    agent_config_option,
    option,
    overrides_option,
    shared_option,
)

if TYPE_CHECKING:
    from benchmarks.vlm_run import VLMRun


@dataclass(frozen=True)
class VLMOptions(OptionGroup):
    """A model's settings, its server, and what it may spend.

    The budgets limit the whole run, however often it is continued; the minutes limit this command.
    """

    agent_config: str | None = shared_option(agent_config_option)
    overrides: Sequence[str] = shared_option(overrides_option("sampling.temperature=0.7"))
    base_url: Sequence[str] = option(
        type=Words(),
        multiple=True,
        metavar="URL",
        help="The address of the model's server. Repeat it for several servers with the same "
        "model: each request goes to the one with the fewest under way.",
    )
    prompts_from: Path | None = option(
        type=EXISTING_FILE,
        metavar="DATASET",
        help="Take the prompts from a training file in the paper's format.",
    )
    concurrency: int | None = option(
        type=click.IntRange(1, 1000), help="The number of simultaneous conversations.  [default: 8]"
    )
    max_usd: float | None = option(
        type=Finite(min=0, min_open=True), help="Stop after spending this many US dollars."
    )
    max_tokens: int | None = option(type=int, help="Stop after this many tokens.")
    max_minutes: float | None = option(
        type=Finite(min=0, min_open=True),
        help="Stop after this many minutes, even within a request.",
    )

    def run(self, name: str) -> VLMRun:
        """A run with the model of a name, such as ``openai:MODEL``.

        Raises:
            ValueError: a setting does not fit.
        """
        from benchmarks.vlm_run import VLMRun

        return VLMRun.of(name, **vars(self))
