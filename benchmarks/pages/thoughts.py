"""Write ten thoughts of a collection, with the pictures that they are about, into docs/data.md.

python -m benchmarks.pages.thoughts DIR
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from random import Random

import click
from PIL import Image

from benchmarks.harness.output import ROOT
from er_gym.data.collection import Collection
from er_gym.data.pictures import open_picture
from er_gym.data.trajectory import THOUGHT_KINDS, ThoughtRecord, Trajectory, Turn

_PAGE = ROOT / "docs" / "data.md"
_PICTURES = ROOT / "docs" / "images" / "thoughts"
_EACH = 2
"""How many thoughts of each kind."""
_SIZE = (400, 225)
_BEGIN, _END = "<!-- thoughts -->", "<!-- end of thoughts -->"


@click.command()
@click.argument("collection", type=click.Path(path_type=Path))
@click.option("--seed", default=0, show_default=True)
def main(collection: Path, seed: int) -> None:
    """Draw the thoughts by the seed, no two of one trajectory, and rewrite the section."""
    found = Collection.open(collection)
    drawn = [*_draw([*found.trajectories()], Random(seed))]
    _PICTURES.mkdir(parents=True, exist_ok=True)
    rows = ["| Picture | Task, thought, action |", "| --- | --- |"]
    for number, (trajectory, turn, thought) in enumerate(drawn, 1):
        name = f"{number:02}.jpg"
        picture = open_picture(found.path / turn.pictures[-1].path)
        picture.resize(_SIZE, Image.Resampling.LANCZOS).save(_PICTURES / name, quality=80)
        text = (
            f"*{trajectory.instruction}* **{thought.kind}**: {thought.text} "
            f"`{turn.action}`".replace("|", "\\|")
        )
        rows.append(f"| ![](images/thoughts/{name}) | {text} |")
    section = "\n".join((_BEGIN, *rows, _END))
    page = _PAGE.read_text(encoding="utf-8")
    page = re.sub(f"{_BEGIN}.*?{_END}", lambda _: section, page, flags=re.DOTALL)
    _PAGE.write_text(page, encoding="utf-8")


def _draw(
    trajectories: list[Trajectory], random: Random
) -> Iterator[tuple[Trajectory, Turn, ThoughtRecord]]:
    """Thoughts of each kind, each of another trajectory, with a picture."""
    random.shuffle(trajectories)
    for kind in THOUGHT_KINDS:
        for _ in range(_EACH):
            while trajectories:
                trajectory = trajectories.pop()
                fitting = [
                    (turn, thought)
                    for turn in trajectory.turns
                    for thought in turn.thoughts
                    if thought.kind == kind and turn.pictures
                ]
                if fitting:
                    yield (trajectory, *random.choice(fitting))
                    break


if __name__ == "__main__":
    main()
