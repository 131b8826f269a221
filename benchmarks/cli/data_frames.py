"""``er-gym data frames``: pictures of rooms with the objects in view."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import INTERRUPTED, BadInput, bad_input, print_problem
from benchmarks.cli.options import (
    EXISTING_FILE,
    FOLDER,
    given_size,
    seed_option,
    size_option,
    workers_option,
)
from benchmarks.terminal import echo, terminal

if TYPE_CHECKING:
    from er_gym.data.frame_camera import Camera, Visit
    from er_gym.data.frames import FramesManifest

_QUALITY = 80
"""Of the JPEGs, as in a collection."""


@click.command()
@click.option("--suite", help="The suite whose rooms are visited, such as train.")
@click.option("--tasks-file", type=EXISTING_FILE, help="Visit the rooms of a file's tasks.")
@click.option(
    "--frames",
    "number",
    required=True,
    type=click.IntRange(min=1),
    help="How many; the same command with a larger number adds frames.",
)
@click.option("--scenes", metavar="SCENE,…", help="Only these rooms of the suite.")
@size_option("--width")
@size_option("--height")
@click.option("--out", required=True, type=FOLDER, help="The directory.")
@workers_option
@seed_option
def frames(
    suite: str | None,
    tasks_file: Path | None,
    number: int,
    scenes: str | None,
    width: int | None,
    height: int | None,
    out: Path,
    workers: int,
    seed: int,
) -> int:
    """Render pictures of a suite's rooms, with the objects in view, to train a model's vision.

    The poses are those of agents, in the suite's arrangements, with some objects opened or switched
    on. er-gym finetune trains on frames. It refuses frames of evaluation rooms: those are for
    measuring a model with python -m benchmarks.vision_probe.
    """
    from er_gym.data.frame_camera import DrawingError, draw_frames, visits
    from er_gym.data.frames import FRAMES, FrameSet
    from er_gym.locking import Locked
    from er_gym.rollout.worker_pool import WorkerSetupError
    from er_gym.writing import ForeignFile

    with bad_input():
        camera, manifest, rooms = _plan(suite, tasks_file, scenes, width, height, out, seed)
        todo = visits(rooms, number, seed)
    try:
        with bad_input(Locked, ForeignFile), FrameSet.locked(out, manifest) as frame_set:
            _draw(draw_frames(frame_set, camera, todo, workers=workers), frame_set, todo, out)
            drawn = [each for visit in todo for each in frame_set.visit(visit.number)][:number]
            frame_set.write(drawn)
    except (WorkerSetupError, DrawingError) as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt:
        print_problem(f"interrupted; the same command continues {out}")
        return INTERRUPTED
    pictures = sum(len(each.pictures) for each in drawn)
    echo(f"{out / FRAMES}: {len(drawn):,} frames with {pictures:,} pictures of {len(rooms)} rooms")
    return 0


def _plan(
    name: str | None,
    tasks_file: Path | None,
    scenes: str | None,
    width: int | None,
    height: int | None,
    out: Path,
    seed: int,
) -> tuple[Camera, FramesManifest, list[Any]]:
    """How frames are drawn, the manifest that states it, and the rooms."""
    from benchmarks.cli.options import named
    from benchmarks.cli.suites import chosen_tasks, suite_given
    from er_gym import __version__
    from er_gym.data.frame_camera import Camera, rooms_of
    from er_gym.data.frames import FramesManifest
    from er_gym.envs.embodied_env import EmbodiedEnv

    doing(f"reading the suite {name or tasks_file}")
    suite = chosen_tasks(suite_given(name, tasks_file), (), named("--scenes", scenes))
    env = {
        "backend": "embedded",
        "width": 800,
        "height": 450,
        "field_of_view": 90.0,
        "grid_size": 0.1,
        "visibility_distance": 20.0,
        **{key: value for key, value in suite.env.items() if key != "instances"},
        **given_size(width, height),
    }
    if env["backend"] != "embedded":
        raise BadInput(
            f"the suite {suite.name} plays on {env['backend']}; frames need the embedded one"
        )
    EmbodiedEnv((), **env)  # so that bad arguments are found before any worker starts
    doing("collecting its rooms")
    rooms = rooms_of(suite.tasks)
    manifest = FramesManifest(
        suite=suite.name,
        suite_digest=suite.digest,
        settings={
            "env": env,
            "pictures": {"format": "jpeg", "quality": _QUALITY},
            "scenes": sorted({room.scene for room in rooms}),
        },
        seed=seed,
        er_gym=__version__,
    )
    return Camera(out, env, "jpeg", _QUALITY, seed), manifest, rooms


def _draw(drawing: Any, frame_set: Any, todo: list[Visit], out: Path) -> None:
    """Draw what is missing, and show how far it is."""
    from contextlib import closing

    from benchmarks.cli.progress import LiveProgress

    there = sum(frame_set.has_visit(visit.number) for visit in todo)
    console = terminal(stderr=True)
    if there:
        console.print(f"{there} of {len(todo)} visits are there already", style="dim")
    with LiveProgress(console, str(out), len(todo), there) as shown, closing(drawing) as visits:
        for done, _ in enumerate(visits, there + 1):
            shown.update(completed=done, status="visits")
