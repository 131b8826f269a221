"""``python -m benchmarks.vision_probe``."""

from __future__ import annotations

from contextlib import closing
from itertools import islice
from pathlib import Path

import click

from agents.factory import load_settings
from agents.vlm.tuned_model import agent_file
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import EXISTING_FOLDER
from benchmarks.scoring.tables import print_tables
from benchmarks.terminal import stdout
from benchmarks.vision_probe.examine import Examiner, examine, figures
from er_gym.data.frames import FrameSet
from er_gym.tables import as_markdown

_SIGHT = {"seeing": False, "blind": True}


@click.command()
@click.argument("model", type=EXISTING_FOLDER)
@click.argument("frames", type=EXISTING_FOLDER)
@click.option("--limit", type=click.IntRange(min=1), help="Only the first N frames.")
@click.option("--batch", type=click.IntRange(min=1), default=32, show_default=True)
@click.option("--md", is_flag=True, help="Print Markdown.")
def main(model: Path, frames: Path, limit: int | None, batch: int, md: bool) -> None:
    """Measure what MODEL sees in FRAMES, beside a blind copy of itself."""
    with bad_input():
        settings = load_settings(
            None,
            ["sampling.max_tokens=200", f"local.batch={batch}", "local.reuse=false"],
            agent_file(str(model)),
        )
        opened = FrameSet.open(frames)
        chosen = list(islice(opened.frames(), limit))
        examiner = Examiner(str(model), opened, settings)
    with closing(examiner):
        found = {
            name: examine(lambda each, b=blind: examiner.answers(each, b), chosen, batch)  # type: ignore[misc]
            for name, blind in _SIGHT.items()
        }
    table = figures(found)
    if md:
        click.echo(as_markdown([table]), nl=False)
    else:
        print_tables([table], stdout())


if __name__ == "__main__":
    main()
