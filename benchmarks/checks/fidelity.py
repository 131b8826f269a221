"""Prints how far the embedded engine agrees with AI2-THOR: all comparisons in one table.

    python -m benchmarks.checks.fidelity [--shared ../shared/data] [--json FILE]

What was recorded is packaged with the engine, but for the captures and the positions of AI2-THOR 5,
which lie in the shared data beside the checkout; without them their rows are left out.
docs/fidelity.md tells what the figures mean.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import click
import numpy as np

from benchmarks.checks.comparisons import captured, recorded
from benchmarks.checks.comparisons import reachable as standing
from benchmarks.harness.output import SHARED, json_option, print_table, write_figures
from er_gym.sim.space.walkable_floor import Rules

CAPTURES = "unity_captures_dev.json"
PLACEMENTS_EACH = 10


@dataclass(frozen=True)
class Row:
    """One figure; ``holds`` is None where no bound is set."""

    name: str
    figure: str
    bound: str = ""
    holds: bool | None = None


def recorded_rows() -> Iterator[Row]:
    """The comparisons with what the packaged scene tables hold."""
    floor = standing.reachable()
    yield Row(
        "at 0.25 m: scenes with all recorded positions",
        f"{floor.recorded} of 120", "120", floor.recorded == 120,
    )  # fmt: skip
    yield Row(
        "at 0.1 m: inside furniture or outside the floor",
        f"{floor.in_furniture + floor.outside} of {floor.fine}", "0",
        bool(floor.in_furniture + floor.outside == 0),
    )  # fmt: skip
    yield Row(
        "at 0.1 m: scenes connected as recorded, or better",
        f"{floor.connected} of 120", "120", floor.connected == 120,
    )  # fmt: skip
    larger = floor.fine / standing.BEFORE
    yield Row(
        "at 0.1 m: positions, as a multiple of those between recorded ones",
        f"{larger:.2f}", f"{standing.LARGER} ± 10 %", abs(larger / standing.LARGER - 1) <= 0.1,
    )  # fmt: skip
    agreed, entries = np.sum([*recorded.openable_poses().values()], axis=0)
    yield _share("poses of openable things: interactable", agreed, entries, 0.90)
    found = recorded.containment()
    yield _share("containment: innermost receptacle", found.innermost, found.objects, 0.95)
    yield _share("containment: all receptacles", found.all_of_them, found.objects)
    put = recorded.random_placements(PLACEMENTS_EACH)
    yield Row(
        "placements that run into something",
        f"{len(put.clashes)} of {put.placed}", "0", not put.clashes,
    )  # fmt: skip
    yield Row(
        "placements not visible, then nearest first",
        f"{len(put.out_of_order)} of {put.placed}", "0", not put.out_of_order,
    )  # fmt: skip
    yield _share("receptacles that had room", put.placed, put.tried)


def sampled_rows(positions_file: Path) -> Iterator[Row]:
    """The comparison with positions that AI2-THOR 5 gave as reachable."""
    given = standing.sample(positions_file)
    shipped = standing.by_kind(standing.agreements(given, Rules()))
    for kind, apart in standing.by_kind(standing.held_out(given)).items():
        name = kind.replace("_", " ")
        yield _share(f"AI2-THOR's positions, {name}", shipped[kind].found, shipped[kind].given)
        yield _share(f"... by the other scenes, {name}", apart.found, apart.given, 0.92)
        yield Row(
            f"size against AI2-THOR's, {name}; by the other scenes",
            f"{shipped[kind].size:.2f}, {apart.size:.2f}",
        )


def captured_rows(captures_file: Path) -> Iterator[Row]:
    """The comparisons with views of AI2-THOR 5."""
    captures = json.loads(captures_file.read_text())
    seen = captured.visible_objects(captures)
    yield Row("visible objects: F1", f"{seen.f1:.3f}", "≥ 0.95", seen.f1 >= 0.95)
    yield Row("visible objects: precision, recall", f"{seen.precision:.3f}, {seen.recall:.3f}")
    halves = [captured.visible_objects(captures, list(captures)[start::2]).f1 for start in (0, 1)]
    yield Row("visible objects: F1 of every other scene", "{:.3f}, {:.3f}".format(*halves))
    found = captured.rooms(captures)
    for name, gaps in (("agent's height", found.agent), ("camera's height", found.camera)):
        farthest = float(abs(gaps).max())
        yield Row(
            f"{name}: farthest off", f"{100 * farthest:.2f} cm", "1 cm", bool(farthest <= 0.01)
        )
    right = len(captures) - len(found.missed)
    yield Row(
        "room bounds: scenes within 0.25 m",
        f"{right} of {len(captures)}", str(len(captures)), right == len(captures),
    )  # fmt: skip
    yield Row("room bounds: faces within 0.25 m", f"{found.faces_right:.3f}")
    apart = [abs(off).max() <= captured.WITHIN for off in captured.held_out(captures).values()]
    yield Row("room bounds: scenes, by the other scenes", f"{sum(apart)} of {len(apart)}")


def _share(name: str, part: int, whole: int, bound: float | None = None) -> Row:
    share = part / whole
    figure = f"{share:.3f} ({part} of {whole})"
    return (
        Row(name, figure)
        if bound is None
        else Row(name, figure, f"≥ {bound}", bool(share >= bound))
    )


@click.command()
@click.option("--shared", type=click.Path(file_okay=False, path_type=Path), default=SHARED)
@json_option
def main(shared: Path, file: Path | None) -> None:
    """Compare, and print the table; takes about a minute."""
    rows, left_out = list(recorded_rows()), []
    for name, compared in ((CAPTURES, captured_rows), (standing.POSITIONS, sampled_rows)):
        if (shared / name).exists():
            rows += compared(shared / name)
        else:
            left_out.append(f"There is no {shared / name} of AI2-THOR 5: not compared.")
    verdicts = {None: "", True: "yes", False: "NO"}
    cells = ((row.name, row.figure, row.bound, verdicts[row.holds]) for row in rows)
    head = ("compared with AI2-THOR", "figure", "bound", "holds")
    print_table("Fidelity", head, cells, words=4, notes=left_out)
    write_figures(file, [asdict(row) for row in rows])


if __name__ == "__main__":
    main()
