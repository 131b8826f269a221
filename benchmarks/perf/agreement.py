"""Whether the picture shows what the metadata says is visible, and the other way round.

    python -m benchmarks.perf.agreement [--poses 500] [--seed 0] [--opened 0.3] [--json FILE]

Random reachable poses in random scenes of all kinds of room, as recorded, or in a share of them
with all open that opens: open doors hide things in the picture, and none in the metadata.
Counted are objects within 5 m: those that the metadata says are visible and whose box takes more
than 150 pixels, and those that take more than 150 pixels of the picture.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from er_gym.sim.render.camera import Camera
from er_gym.sim.render.stage import stage
from er_gym.sim.scene import SCENE_NAMES
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World
from er_gym.thor import make_controller

WIDTH, HEIGHT, FIELD_OF_VIEW = 300, 300, 90.0
FARTHEST, LEAST = 5.0, 150
HORIZONS = (-30.0, 0.0, 30.0)


@dataclass
class Agreement:
    """What was counted, by object type.

    Attributes:
        said, shown: objects that the metadata says are visible, and those that have pixels then.
        drawn, known: objects that have many pixels, and those that the metadata says are visible.
    """

    said: Counter[str] = field(default_factory=Counter)
    shown: Counter[str] = field(default_factory=Counter)
    drawn: Counter[str] = field(default_factory=Counter)
    known: Counter[str] = field(default_factory=Counter)

    @property
    def of_visible(self) -> float:
        """Share of the visible objects that the picture shows."""
        return self.shown.total() / max(1, self.said.total())

    @property
    def of_drawn(self) -> float:
        """Share of the objects drawn that the metadata says are visible."""
        return self.known.total() / max(1, self.drawn.total())


def compare(
    poses: int, seed: int, opened: float = 0.0, console: Console | None = None
) -> Agreement:
    """Count over random poses; ``opened``: the share of these with all open that opens."""
    random, found = np.random.default_rng(seed), Agreement()
    controller = make_controller(
        headless=True, width=WIDTH, height=HEIGHT, fieldOfView=FIELD_OF_VIEW,
        visibilityDistance=20, gridSize=0.25, snapToGrid=False,
    )  # fmt: skip
    hidden = console is None or not console.is_terminal
    for _ in track(range(poses), "poses", console=console, disable=hidden):
        event = controller.reset(str(random.choice(SCENE_NAMES)))
        if random.random() < opened:
            for entry in event.metadata["objects"]:
                if entry["openable"]:
                    controller.step(
                        action="OpenObject", objectId=entry["objectId"], forceAction=True
                    )
        places = controller.step(action="GetReachablePositions").metadata["actionReturn"]
        controller.step(
            action="TeleportFull",
            position=places[int(random.integers(len(places)))],
            rotation={"x": 0.0, "y": float(random.uniform(0, 360)), "z": 0.0},
            horizon=float(random.choice(HORIZONS)),
            standing=True,
        )
        _count(controller.server._engine.world, found)
    controller.stop()
    return found


def _count(world: World, found: Agreement) -> None:
    agent = world.agent
    camera = Camera(agent.camera, agent.rotation, agent.horizon, FIELD_OF_VIEW, WIDTH, HEIGHT)
    ids = stage(world.scene.name).draw(world, camera).ids
    pixels = np.bincount(ids.ravel(), minlength=len(world) + 1)[1:]
    seen = visible(world)
    middle = (world.low + world.high) / 2
    near = np.hypot(*(middle - agent.position)[:, [0, 2]].T) <= FARTHEST
    for i in np.flatnonzero(near & ~world.hidden).tolist():
        kind = world.types[i]
        if seen[i] and _area(camera, world.low[i], world.high[i]) > LEAST:
            found.said[kind] += 1
            found.shown[kind] += int(pixels[i] > 0)
        if pixels[i] > LEAST:
            found.drawn[kind] += 1
            found.known[kind] += int(seen[i])


def _area(camera: Camera, low: np.ndarray, high: np.ndarray) -> float:
    """Pixels of the rectangle around a box's picture; all of it where the box is at the camera."""
    ends = np.array([low, high])
    corners = np.array([(ends[a, 0], ends[b, 1], ends[c, 2]) for a, b, c in np.ndindex(2, 2, 2)])
    projected = camera.project(corners)
    if (projected[:, 2] <= 0.1).any():
        return float(WIDTH * HEIGHT)
    lower = np.clip(projected[:, :2].min(axis=0), 0, (WIDTH, HEIGHT))
    upper = np.clip(projected[:, :2].max(axis=0), 0, (WIDTH, HEIGHT))
    return float(np.prod(upper - lower))


def _table(found: Agreement) -> Table:
    table = Table(title="picture and metadata")
    table.add_column("type")
    for name in ("visible", "of these shown", "drawn", "of these visible"):
        table.add_column(name, justify="right")
    missed = {k: (found.said[k] - found.shown[k]) + (found.drawn[k] - found.known[k])
              for k in found.said | found.drawn}  # fmt: skip
    for kind in sorted(missed, key=lambda k: -missed[k])[:15]:
        row = (found.said, found.shown, found.drawn, found.known)
        table.add_row(kind, *(str(counts[kind]) for counts in row))
    table.add_section()
    table.add_row(
        "all",
        str(found.said.total()),
        f"{found.of_visible:.1%}",
        str(found.drawn.total()),
        f"{found.of_drawn:.1%}",
    )
    return table


@click.command()
@click.option("--poses", default=500, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=0, show_default=True)
@click.option("--opened", default=0.0, show_default=True, type=click.FloatRange(0, 1))
@click.option("--json", "file", type=click.Path(dir_okay=False, path_type=Path))
def main(poses: int, seed: int, opened: float, file: Path | None) -> None:
    """Compare, and print the types that disagree most."""
    found = compare(poses, seed, opened, Console(stderr=True))
    Console(width=None if sys.stdout.isatty() else 100).print(_table(found))
    if file is not None:
        shares: dict[str, Any] = {"visible": found.of_visible, "drawn": found.of_drawn}
        file.write_text(json.dumps(shares) + "\n")


if __name__ == "__main__":
    main()
