"""``er-gym render`` and ``er-gym play``: look at a room, and play a task yourself."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input
from benchmarks.cli.options import FILE, FOLDER, Finite, force_option, seed_option
from benchmarks.terminal import echo

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

WHAT = ("rgb", "depth", "ids", "map")
_ENDINGS = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")
_ENDINGS_OF_DEPTH = (".png", ".tif", ".tiff")
"""The formats that hold 16 bits."""
_DEPTH_UNIT = 1000.0
"""Steps per metre in a depth picture, which has 16 bits."""


@click.command()
@click.option("--scene", required=True, help="The scene, such as FloorPlan1 or House3-17.")
@click.option(
    "--pose",
    metavar="X,Z,ROTATION[,HORIZON]",
    help="The agent's pose, metres and degrees.  [default: the start of the scene]",
)
@click.option(
    "--what", type=click.Choice(WHAT), default="rgb", show_default=True, help="The kind of picture."
)
@click.option(
    "--width", type=click.IntRange(64, 1920), default=800, show_default=True, help="Pixels."
)
@click.option(
    "--height", type=click.IntRange(64, 1280), default=450, show_default=True, help="Pixels."
)
@click.option(
    "--fov",
    type=Finite(30, 150),
    default=90,
    show_default=True,
    help="The vertical field of view, degrees.",
)
@click.option("--annotate", is_flag=True, help="Label objects with their types.")
@click.option(
    "--out", default=Path("room.png"), show_default=True, help="The picture's file.",
    type=FILE,
)  # fmt: skip
@force_option
def render(
    scene: str, pose: str | None, what: str, width: int, height: int, fov: float, annotate: bool,
    out: Path, force: bool,
) -> None:  # fmt: skip
    """Write a picture of a room.

    rgb shows what the agent sees. depth shows the same view in millimetres, with 16 bits a pixel.
    ids gives each object a colour of its own. map shows the whole room from above.
    """
    from PIL import Image

    from er_gym.houses.names import is_house
    from er_gym.thor import SCENE_NAMES, UnknownSceneError, make_controller
    from er_gym.writing import check_output, write_picture

    if scene not in SCENE_NAMES and not is_house(scene):
        raise BadInput(str(UnknownSceneError(scene)))
    endings = _ENDINGS_OF_DEPTH if what == "depth" else _ENDINGS
    if out.suffix.lower() not in endings:
        raise BadInput(f"--out {out}: the file name must end in one of: {', '.join(endings)}")
    with bad_input():
        check_output(out, force=force)
    stand = None if pose is None else _pose(pose)
    controller = make_controller(
        scene=scene,
        width=width,
        height=height,
        fieldOfView=fov,
        renderDepthImage=what == "depth",
        renderInstanceSegmentation=what == "ids" or annotate,
        snapToGrid=False,
    )
    if stand is not None:
        _teleport(controller, stand)
    event = controller.last_event
    if what == "map":
        event = _top_view(controller)
        frame = event.third_party_camera_frames[-1]
    elif what == "depth":
        frame = (event.depth_frame * _DEPTH_UNIT).clip(0, 65535).astype("uint16")
    elif what == "ids":
        frame = event.instance_segmentation_frame
    else:
        frame = event.frame
    if annotate and what == "rgb":
        from er_gym.envs.annotate import annotated

        frame = annotated(frame, event.instance_detections2D)
    with bad_input():
        write_picture(out, Image.fromarray(frame), force=force)
    agent = event.metadata["agent"]
    at = agent["position"]
    echo(
        f"{out}: {what} of {scene} from ({at['x']:.2f}, {at['z']:.2f}), rotation "
        f"{agent['rotation']['y']:g}, horizon {agent['cameraHorizon']:g}"
    )


def _pose(text: str) -> tuple[float, float, float, float]:
    """Parse a pose from text: x, z, rotation and horizon; metres and degrees."""
    found: tuple[float, ...]
    try:
        found = tuple(float(number) for number in text.split(","))
    except ValueError:
        found = ()
    if len(found) not in (3, 4) or not all(map(math.isfinite, found)):
        raise BadInput(
            f"{text!r:.80} is not a pose; give X,Z,ROTATION or X,Z,ROTATION,HORIZON, such as "
            "1.0,-0.5,90"
        )
    x, z, rotation, tilt = (*found, 0.0)[:4]
    return x, z, rotation, tilt


def _teleport(controller: Any, pose: tuple[float, float, float, float]) -> None:
    """Put the agent at a pose."""
    x, z, rotation, tilt = pose
    agent = controller.last_event.metadata["agent"]["position"]
    event = controller.step(
        action="TeleportFull", position={"x": x, "y": agent["y"], "z": z},
        rotation={"x": 0.0, "y": rotation, "z": 0.0}, horizon=tilt, standing=True,
    )  # fmt: skip
    if not event.metadata["lastActionSuccess"]:
        raise BadInput(event.metadata["errorMessage"])


def _top_view(controller: Any) -> Any:
    """An event with a picture of the whole room from above; the ceiling is not drawn from there."""
    event = controller.step(action="GetMapViewCameraProperties")
    camera, aspect = event.metadata["actionReturn"], event.screen_width / event.screen_height
    size = camera["orthographicSize"] / min(1.0, aspect)
    return controller.step(action="AddThirdPartyCamera", **{**camera, "orthographicSize": size})


@click.command()
@click.option("--suite", default="mini", show_default=True, help="The suite of the task.")
@click.option("--task", "task_id", help="The id of the task.  [default: a random task]")
@click.option("--scene", help="Choose among the tasks in this scene.")
@seed_option
@click.option(
    "--frames", default=Path("frames"), show_default=True,
    type=FOLDER, help="The folder for each step's picture.",
)  # fmt: skip
@force_option
@click.option(
    "--window/--no-window",
    default=None,
    help="Show the pictures in a window.  [default: if possible]",
)
def play(
    suite: str, task_id: str | None, scene: str | None, seed: int, frames: Path,
    force: bool, window: bool | None,
) -> None:  # fmt: skip
    """Play a task yourself by typing actions.

    Each step's picture is written to a file, and shown in a window if possible.
    """
    from er_gym.envs.embodied_env import EmbodiedEnv
    from er_gym.rollout.selection import select
    from er_gym.tasks.suites import load_suite
    from er_gym.writing import check_output, make_folder

    with bad_input():
        known = select(load_suite(suite).tasks, task_ids=() if task_id is None else (task_id,))
    tasks = [task for task in known if scene is None or task.scene == scene]
    if not tasks:
        scenes = ", ".join(sorted({task.scene for task in known})[:3])
        raise BadInput(f"no task to play in {scene}; the scenes of {suite} are such as {scenes}")
    with bad_input():
        make_folder(frames)
        for file in frames.glob("[0-9][0-9][0-9].png"):
            check_output(file, force=force)
    show = _window(window)
    env = EmbodiedEnv(tasks, obs_mode="rgb+text", max_steps=None)
    obs, _ = env.reset(seed=seed)
    step = 0
    while True:
        _write_frame(obs["rgb"], frames / f"{step:03d}.png", show, force)
        echo(f"\n{obs['text']}")
        try:
            said = click.prompt("What do you do", default="quit", show_default=True)
        except click.Abort:
            said = "quit"
        if said == "quit":
            break
        obs, reward, terminated, truncated, info = env.step(said)
        step += 1
        if reward:
            echo(f"reward {reward:g}")
        if terminated or truncated:
            _write_frame(obs["rgb"], frames / f"{step:03d}.png", show, force)
            outcome = "solved" if info["success"] else f"not solved ({info['end_reason']})"
            echo(f"\n{obs['text']}\n{outcome} after {info['steps']} steps")
            break
    env.close()
    echo(f"pictures in {frames}")


def _write_frame(frame: NDArray[np.uint8], file: Path, show: Any, force: bool) -> None:
    from PIL import Image

    from er_gym.writing import write_picture

    picture = Image.fromarray(frame)
    with bad_input():
        write_picture(file, picture, force=force)
    if show is not None:
        show(picture)


def _window(wanted: bool | None) -> Any:
    """A function that shows a picture in a window; None if a window is impossible or not wanted."""
    if wanted is False:
        return None
    try:
        import tkinter

        from PIL import ImageTk

        root = tkinter.Tk()
    except (
        Exception
    ) as error:  # no Tk, no display: tkinter.TclError is no class where it is missing
        if wanted:
            raise BadInput(f"no window can be opened here: {error}") from None
        return None
    root.title("er-gym")
    label = tkinter.Label(root)
    label.pack()

    def show(picture: Any) -> None:
        label.image = ImageTk.PhotoImage(picture)  # type: ignore[attr-defined]  # keeps it alive
        label.configure(image=label.image)  # type: ignore[attr-defined]
        root.update()

    return show
