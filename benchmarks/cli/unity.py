"""``er-gym unity``: capture a Unity build of AI2-THOR, and compare the embedded engine with it."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import EXISTING_FOLDER, force_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    from benchmarks.unity.captures import CaptureSettings


@click.group()
def unity() -> None:
    """Capture a Unity build of AI2-THOR, and compare the embedded engine with it.

    On a machine with the build: er-gym unity doctor, then er-gym unity collect --out captures, then
    er-gym unity compare captures --out report.md. Not run on Unity yet; tested with er-gym's player
    in its place.
    """


@unity.command()
def doctor() -> int:
    """Say what this machine lacks to run Unity's build."""
    from benchmarks.cli.doctor import show_checks
    from benchmarks.cli.doctor_checks import unity_checks

    return show_checks(unity_checks())


@unity.command()
@click.option("--out", type=click.Path(path_type=Path), required=True, help="The captures' folder.")
@click.option("--scenes", metavar="SCENE,…", help="Only these rooms.  [default: all 120]")
@click.option("--poses", type=click.IntRange(0, 1000), default=4, show_default=True,
              help="Views of each room.")  # fmt: skip
@click.option("--width", type=click.IntRange(1, 4096), default=640, show_default=True)
@click.option("--height", type=click.IntRange(1, 4096), default=480, show_default=True)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the poses.")
@click.option("--program", type=click.Path(exists=True, dir_okay=False),
              help="The build's executable, if the client is not to find it.")  # fmt: skip
def collect(
    out: Path,
    scenes: str | None,
    poses: int,
    width: int,
    height: int,
    seed: int,
    program: str | None,
) -> None:
    """Capture rooms: metadata, reachable positions, and views with their pictures.

    The same command, given again, captures only what is missing.
    """
    from ai2thor._builds import COMMIT_ID

    from benchmarks.unity.captures import (
        FORMAT,
        MANIFEST,
        CaptureSettings,
        capture,
        room_file,
        save,
    )
    from er_gym.thor import BackendError, UnknownSceneError, make_controller
    from er_gym.writing import make_folder, write_output

    settings = CaptureSettings(width, height, poses, seed)
    chosen = _scenes(scenes)
    told = {"format": FORMAT, "build": COMMIT_ID, "program": program or "", **asdict(settings)}
    with bad_input(UnknownSceneError, BackendError):
        make_folder(out)
        if (out / MANIFEST).exists() and _manifest(out) != told:
            raise BadInput(f"{out} has captures with other settings; name another --out")
        write_output(out / MANIFEST, json.dumps(told, indent=1))
        left = [scene for scene in chosen if not room_file(out, scene).exists()]
        echo(f"{len(chosen) - len(left)} of {len(chosen)} rooms are there")
        if not left:
            return
        where = {"local_executable_path": program, "x_display": ":0"} if program else {}
        controller = make_controller("unity", width=width, height=height, **where)
        try:
            for number, scene in enumerate(left, len(chosen) - len(left) + 1):
                save(out, capture(controller, scene, settings))
                echo(f"{scene}: {number} of {len(chosen)} rooms")
        finally:
            controller.stop()
    echo(f"{out}; next: er-gym unity compare {out}")


@unity.command()
@click.argument("captures", type=EXISTING_FOLDER)
@click.option("--out", type=click.Path(path_type=Path),
              help="Write the tables here (.md), and pairs of pictures beside it.")  # fmt: skip
@force_option
def compare(captures: Path, out: Path | None, force: bool) -> None:
    """Compare the embedded engine with captures: objects, positions, views, pairs of pictures."""
    from benchmarks.unity.captures import capture, load
    from benchmarks.unity.comparison import compare as compared
    from benchmarks.unity.comparison import summed, table
    from er_gym.tables import as_markdown
    from er_gym.thor import make_controller
    from er_gym.writing import MARKDOWN_MARK, check_output, write_output

    with bad_input():
        if out is not None:
            check_output(out, force=force)
        settings = _settings(_manifest(captures))
        names = sorted(file.stem for file in (captures / "rooms").glob("*.json"))
        if not names:
            raise BadInput(f"{captures} has no room; er-gym unity collect --out {captures}")
        controller = make_controller(width=settings.width, height=settings.height)
        found = {}
        try:
            for number, scene in enumerate(names, 1):
                theirs = load(captures, scene)
                poses = [view["pose"] for view in theirs.views]
                ours = capture(controller, scene, settings, poses)
                found[scene] = tuple(compared(theirs, ours))
                if out is not None and theirs.pictures:
                    _write_pairs(out, scene, theirs.pictures, ours.pictures, force)
                echo(f"{scene}: {number} of {len(names)} rooms")
        finally:
            controller.stop()
        whole = table(summed(found.values()), f"{len(names)} rooms")
        if out is None:
            echo(as_markdown([whole]))
            return
        parts = [table(figures, scene) for scene, figures in found.items()]
        head = "# The embedded engine beside captures of Unity\n\n"
        write_output(out, MARKDOWN_MARK + head + as_markdown([whole, *parts]), force=force)
    echo(f"{out}")


def _write_pairs(out: Path, scene: str, theirs: Any, ours: Any, force: bool) -> None:
    """Pictures of Unity on the left, the engine's of the same pose on the right."""
    import numpy as np
    from PIL import Image

    from er_gym.writing import make_folder, write_picture

    folder = out.with_suffix("")
    make_folder(folder)
    rows = [np.hstack(pair) for pair in zip(theirs, ours, strict=True)]
    write_picture(folder / f"{scene}.png", Image.fromarray(np.vstack(rows)), force=force)


def _scenes(names: str | None) -> tuple[str, ...]:
    from er_gym.thor import SCENE_NAMES

    if names is None:
        return tuple(SCENE_NAMES)
    chosen = tuple(filter(None, (name.strip() for name in names.split(","))))
    unknown = [name for name in chosen if name not in SCENE_NAMES]
    if unknown or not chosen:
        raise BadInput(
            f"--scenes {names}: there is no room {unknown[0] if unknown else 'named'}; "
            "the rooms are FloorPlan1 to 30, 201 to 230, 301 to 330 and 401 to 430"
        )
    return chosen


def _manifest(folder: Path) -> dict[str, Any]:
    from benchmarks.unity.captures import FORMAT, MANIFEST

    try:
        told = json.loads((folder / MANIFEST).read_text("utf-8"))
        if told["format"] != FORMAT:
            raise ValueError(f"its format is {told['format']!r}, and {FORMAT} is read")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BadInput(f"{folder} has no captures of er-gym unity collect: {error}") from None
    return dict(told)


def _settings(manifest: dict[str, Any]) -> CaptureSettings:
    from dataclasses import fields

    from benchmarks.unity.captures import CaptureSettings

    try:
        return CaptureSettings(
            **{each.name: int(manifest[each.name]) for each in fields(CaptureSettings)}
        )
    except (KeyError, TypeError, ValueError) as error:
        raise BadInput(f"captures.json lacks a setting: {error}") from None
