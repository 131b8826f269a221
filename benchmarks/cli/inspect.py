"""``er-gym inspect``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import CRASHED, BadInput, bad_input, needing, print_problem
from benchmarks.cli.options import Words, agent_config_option, overrides_option, seed_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from inspect_ai.log import EvalLog


@click.command(name="inspect")
@click.option(
    "--suite", default="mini", show_default=True, help="The suite; `er-gym suites` lists them."
)
@click.option(
    "--model",
    required=True,
    type=Words(),
    help="The model, as Inspect names it: openai/gpt-4o, vllm/…, mockllm/model.",
)
@click.option("--model-base-url", metavar="URL", help="The address of the model's server.")
@agent_config_option
@overrides_option("sees=text")
@click.option("--limit", type=click.IntRange(min=1), help="Play no more than the first N tasks.")
@seed_option
@click.option(
    "--concurrency",
    type=click.IntRange(1, 256),
    default=4,
    show_default=True,
    help="The number of simultaneous conversations. Each has an engine in its own process.",
)
@click.option(
    "--log-dir",
    metavar="DIRECTORY",
    help="Where Inspect writes its logs.  [default: Inspect's, ./logs]",
)
def inspect(
    suite: str,
    model: str,
    model_base_url: str | None,
    agent_config: str | None,
    overrides: tuple[str, ...],
    limit: int | None,
    seed: int,
    concurrency: int,
    log_dir: str | None,
) -> int:
    """Play a suite with a model of Inspect; needs the extra inspect.

    `inspect view` then shows every conversation with its pictures. To use all options of Inspect:
    `inspect eval benchmarks/inspect_task.py@er_gym`.
    """
    from er_gym.activity import begin_import

    begin_import("Inspect", "inspect_ai", "textual")
    with needing("Inspect", "er-gym[inspect]"):
        # Inspect's display on a terminal; it would import this later, while nothing is said.
        import textual.app
        import textual.widgets  # noqa: F401
        from inspect_ai import eval as evaluate
        from inspect_ai._util.error import PrerequisiteError  # a key or a package is missing

        from benchmarks.inspect_secrets import model_at_url
        from benchmarks.inspect_task import er_gym
    with bad_input():
        doing("reading the suite")
        asked = er_gym(suite, limit, agent_config, overrides, seed)
        try:
            doing(f"reaching {model}")
            chosen = model_at_url(model, model_base_url)
            doing("")  # Inspect's display follows
            logs = evaluate(
                asked,
                model=chosen,
                log_dir=log_dir,
                max_samples=concurrency,
            )
        except PrerequisiteError as error:
            from rich.text import Text

            said = Text.from_markup(str(error.message)).plain
            raise BadInput(" ".join(said.split())) from error
    return _say(logs[0])


def _say(log: EvalLog) -> int:
    """The means, and where the log is."""
    results: Any = log.results.scores if log.results else []
    for metric in results:
        mean = metric.metrics.get("mean")
        if mean is not None:
            echo(f"{metric.name}: {mean.value:.3f}")
    echo(log.location)
    if log.status == "success":
        return 0
    why = log.error.message if log.error else "cancelled"
    print_problem(f"the evaluation ended early: {why}")
    return CRASHED
