"""Compares the objects that a picture shows with those that the metadata call visible.

    python -m benchmarks.checks.picture_agreement [--poses 300] [--seed 0] [--opened 0.3]
                                                  [--json FILE]

Everything goes through the official client's Controller: random scenes of all kinds of room, random
places of GetReachablePositions, headings of any degree or of multiples of 45 and 90, any horizon
from -30 to 60 degrees, standing or crouching, a visibilityDistance of 1.5 m or 20 m, and in a share
of the poses some doors and drawers open. At each pose two shares are counted, at each picture size:

* shown: of the objects whose metadata say ``visible``, those that take :data:`LEAST` pixels of the
  instance segmentation, and those that take any;
* told: of the objects that take so many pixels and whose ``distance`` is within the
  visibilityDistance, those whose metadata say ``visible``.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np

from benchmarks.harness.output import json_option, print_table, progress, write_figures
from er_gym.thor import SCENE_NAMES, make_controller

SIZES = ((300, 300), (800, 450))
LEAST = 20
"""The least pixels that show an object."""
DISTANCES = (1.5, 20.0)
TURNS = (1, 45, 90)
"""Headings are multiples of one of these, degrees."""
SHOWN, TOLD = 0.95, 0.97
"""The targets of both shares."""
_OPEN = 0.5
"""The share of the doors and drawers of a pose that are open, where some are."""
_ROWS = 20


@dataclass(frozen=True)
class Sighting:
    """One object seen from one pose, according to the metadata or the picture.

    Attributes:
        kind: its object type. size: of the picture, pixels.
        reach: the visibilityDistance, metres. near: whether its ``distance`` is within that.
        visible: according to the metadata. pixels: how many it covers.
    """

    kind: str
    size: tuple[int, int]
    reach: float
    near: bool
    visible: bool
    pixels: int


@dataclass(frozen=True)
class Shares:
    """The counts of some sightings."""

    visible: int
    shown: int
    any_pixel: int
    in_picture: int
    told: int

    @staticmethod
    def of(sightings: Iterable[Sighting]) -> Shares:
        """Count."""
        found: Counter[str] = Counter()
        for seen in sightings:
            large = seen.pixels >= LEAST
            found["visible"] += seen.visible
            found["shown"] += seen.visible and large
            found["any_pixel"] += seen.visible and seen.pixels > 0
            found["in_picture"] += large and seen.near
            found["told"] += large and seen.near and seen.visible
        names = ("visible", "shown", "any_pixel", "in_picture", "told")
        return Shares(*(found[name] for name in names))

    @property
    def missed(self) -> int:
        """Objects about which picture and metadata disagree."""
        return self.visible - self.shown + self.in_picture - self.told

    def row(self) -> list[str]:
        """The shares, as a table has them."""
        return [
            str(self.visible),
            _share(self.shown, self.visible),
            _share(self.any_pixel, self.visible),
            str(self.in_picture),
            _share(self.told, self.in_picture),
        ]


def _share(part: int, whole: int) -> str:
    return f"{part / whole:.1%}" if whole else ""


def sightings(poses: int, seed: int, opened: float) -> Iterator[Sighting]:
    """Sightings from random poses; ``opened``: the share of poses with some doors open.

    The poses are the same at both sizes.
    """
    random = np.random.default_rng(seed)
    controller = make_controller(renderInstanceSegmentation=True)
    for _ in progress(range(poses), "poses"):
        scene, reach = str(random.choice(SCENE_NAMES)), float(random.choice(DISTANCES))
        draws, ajar = random.random(4), random.random() < opened
        turn = int(random.choice(TURNS))
        doors = np.random.default_rng(int(random.integers(1 << 32)))
        event = controller.reset(
            scene, width=SIZES[0][0], height=SIZES[0][1], visibilityDistance=reach,
            gridSize=0.25, snapToGrid=False,
        )  # fmt: skip
        for entry in event.metadata["objects"]:
            if ajar and entry["openable"] and doors.random() < _OPEN:
                controller.step("OpenObject", objectId=entry["objectId"], forceAction=True)
        places = controller.step("GetReachablePositions").metadata["actionReturn"]
        controller.step(
            "TeleportFull",
            **places[int(draws[0] * len(places))],
            rotation=int(draws[1] * 360 / turn) * turn,
            horizon=float(-30 + 90 * draws[2]),
            standing=bool(draws[3] < 0.5),
            forceAction=True,
        )
        for size in SIZES:
            event = controller.step("ChangeResolution", x=size[0], y=size[1])
            yield from _seen(controller.step("Pass"), size, reach)
    controller.stop()


def _seen(event: Any, size: tuple[int, int], reach: float) -> Iterator[Sighting]:
    pixels = _pixels(event)
    for entry in event.metadata["objects"]:
        count = pixels.get(entry["objectId"], 0)
        if entry["visible"] or count:
            near = bool(entry["distance"] <= reach)
            yield Sighting(entry["objectType"], size, reach, near, entry["visible"], count)


def _pixels(event: Any) -> Mapping[str, int]:
    """The pixels of each object id in an event's instance segmentation."""
    frame = event.instance_segmentation_frame.astype(np.int64)
    colours, counts = np.unique(frame @ (1 << 16, 1 << 8, 1), return_counts=True)
    found = dict(zip(colours.tolist(), counts.tolist(), strict=True))
    return {
        name: found.get((r << 16) + (g << 8) + b, 0)
        for name, (r, g, b) in event.object_id_to_color.items()
    }


def _show(found: list[Sighting]) -> None:
    """Print the shares of each size, and then of the types."""
    columns = ("visible", f">= {LEAST} px", "any px", f"with {LEAST} px", "visible")
    rows: list[tuple[str, Shares]] = []
    for size in SIZES:
        at = [s for s in found if s.size == size]
        rows.append(("{}×{}".format(*size), Shares.of(at)))
        rows += [
            (f"visibilityDistance {reach:g}", Shares.of(s for s in at if s.reach == reach))
            for reach in DISTANCES
        ]
    title = f"picture and metadata; wanted: {SHOWN:.0%} and {TOLD:.0%}"
    print_table(title, ("pictures", *columns), ((name, *each.row()) for name, each in rows))
    for size in SIZES:
        kinds = [*by_type(s for s in found if s.size == size).items()][:_ROWS]
        title = "{}×{}: the types that disagree most".format(*size)
        print_table(title, ("type", *columns), ((kind, *each.row()) for kind, each in kinds))


def by_type(found: Iterable[Sighting]) -> dict[str, Shares]:
    """The counts of each object type, those with most disagreements first."""
    kinds: dict[str, list[Sighting]] = {}
    for seen in found:
        kinds.setdefault(seen.kind, []).append(seen)
    shares = {kind: Shares.of(those) for kind, those in kinds.items()}
    return dict(sorted(shares.items(), key=lambda item: (-item[1].missed, item[0])))


@click.command()
@click.option("--poses", default=300, show_default=True, type=click.IntRange(1))
@click.option("--seed", default=0, show_default=True)
@click.option("--opened", default=0.3, show_default=True, type=click.FloatRange(0, 1))
@json_option
def main(poses: int, seed: int, opened: float, file: Path | None) -> None:
    """Compare, and print the shares, and the types that disagree most."""
    found = list(sightings(poses, seed, opened))
    _show(found)
    told = {
        "{}x{}".format(*size): {
            kind: vars(shares)
            for kind, shares in by_type(s for s in found if s.size == size).items()
        }
        for size in SIZES
    }
    write_figures(file, told)


if __name__ == "__main__":
    main()
