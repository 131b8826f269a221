"""``er-gym houses``: generate houses."""

from __future__ import annotations

import json
from pathlib import Path

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import FOLDER, MOST_SEED, Span, force_option
from benchmarks.terminal import echo


@click.group()
def houses() -> None:
    """Generate houses of several rooms, in ProcTHOR's JSON."""


@houses.command()
@click.option(
    "--seed",
    type=click.IntRange(0, MOST_SEED),
    default=0,
    show_default=True,
    help="The seed of the first house; each next one has the next seed.",
)
@click.option(
    "--rooms",
    type=Span(),
    default="1-6",
    show_default=True,
    help="How many rooms they have, from 1 to 6, in turn.",
)
@click.option("--count", type=click.IntRange(min=1), default=1, show_default=True)
@click.option("--out", type=FOLDER, required=True, help="The directory of the houses.")
@force_option
def generate(
    seed: int, rooms: tuple[float, float | None], count: int, out: Path, force: bool
) -> None:
    """Write houses that are furnished, walkable, and the same for the same seed.

    Each is a file such as House3-17.json: three rooms, seed 17. Programs give it to AI2-THOR's
    Controller as its scene. In er-gym the name alone is enough, in tasks and as a scene.
    """
    from er_gym.houses.generate import MOST_ROOMS, generate_house
    from er_gym.houses.names import house_name
    from er_gym.writing import make_folder, write_output

    least, most = int(rooms[0]), int(rooms[1] or MOST_ROOMS)
    if not 1 <= least <= most <= MOST_ROOMS or rooms[0] != least or (rooms[1] or most) != most:
        raise BadInput(f"--rooms is from 1 to {MOST_ROOMS}, such as 3 or 2-4")
    with bad_input():
        make_folder(out)
    choices = range(least, most + 1)
    for number in range(count):
        has = choices[number % len(choices)]
        name = house_name(seed + number, has)
        doing(f"house {number + 1} of {count}: {name}")
        house = generate_house(seed + number, has)
        with bad_input():
            write_output(out / f"{name}.json", json.dumps(house) + "\n", force=force)
    echo(f"{count} {'house' if count == 1 else 'houses'}: {out}")
