"""docs/gallery.md and the README's picture: every type of thing with its name, rooms of each kind,
twelve rooms in both lights, and ten houses.

    python -m benchmarks.pages.gallery [--kinds Fridge,Mug --states --out sheet.png]

Without options the gallery is made anew; with ``--kinds``, one contact sheet of some types.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT
from benchmarks.harness.samples import sheet
from benchmarks.pages.houses import house_pages
from er_gym.sim.actions import perform
from er_gym.sim.agent import Agent
from er_gym.sim.render.appearance import Appearance, compute_appearance
from er_gym.sim.render.bake import pieces_of_look
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.panda import core, geometry, rasteriser
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.render.shapes import SHAPES, build
from er_gym.sim.scene import SCENE_NAMES, SCENE_NUMBERS, load_scene
from er_gym.sim.settings import FLAT, SOFT, Settings
from er_gym.sim.world import World
from er_gym.writing import (
    MARKDOWN_MARK,
    check_output,
    picture_format,
    write_output,
    write_picture,
)

DOCS = ROOT / "docs"
_SIDE, _COLUMNS = 150, 10
_ROOM = (640, 400)
_ROOMS = {"kitchens": (1, 27), "living_rooms": (212, 227), "bedrooms": (301, 315),
          "bathrooms": (403, 413)}  # fmt: skip
_LIT = {"kitchens": (5, 9, 22), "living_rooms": (207, 222, 228), "bedrooms": (301, 306, 318),
        "bathrooms": (402, 407, 424)}  # fmt: skip
"""Rooms that are shown in flat and in soft light."""
_PAIR = (400, 250)
_IN_FRONT = {"kitchens": 0, "living_rooms": 2, "bedrooms": 0, "bathrooms": 0}
"""The view of each kind of room that is in the README's picture."""
_CUT = {"Sliced": "SliceObject", "Cracked": "BreakObject"}
"""Endings of types that an action creates, and the action."""


def looks(kind: str, count: int = 1) -> list[Appearance]:
    """Some objects of a type, of as many different assets and rooms as there are."""
    found: dict[tuple[str, ...], Appearance] = {}
    for name in SCENE_NAMES:
        world = _world_with(kind, name)
        if world is not None:
            look = compute_appearance(world, next(world.of_type(kind)))
            key = (look.asset,) if look.asset else (look.room, str(len(found) % 3))
            found.setdefault(key, look)
    kept = list(found.values())
    return kept[:: max(1, len(kept) // count)][:count]


def _world_with(kind: str, scene_name: str) -> World | None:
    """A scene with an object of a type, made by an action if needed; None if impossible."""
    scene = load_scene(scene_name)
    if kind in scene.types:
        return World.load(scene, Settings())
    for end, action in _CUT.items():
        whole = kind.removesuffix(end)
        if whole != kind and whole in scene.types:
            world = World.load(scene, Settings())
            thing = world.object_ids[next(world.of_type(whole))]
            perform(world, {"action": action, "objectId": thing, "forceAction": True})
            return world
    return None


def states(look: Appearance) -> Iterator[tuple[str, Appearance]]:
    """A picture of each state that changes the object's triangles."""
    plain = replace(look, openness=0.0, on=False, filled="", dirty=False, cooked=False)
    yield "", plain
    drawn = build(plain)
    for name, other in (
        ("half open", replace(plain, openness=0.5)),
        ("open", replace(plain, openness=1.0)),
        ("on", replace(plain, on=True)),
        ("filled", replace(plain, filled="water")),
        ("dirty", replace(plain, dirty=True)),
        ("cooked", replace(plain, cooked=True)),
        ("broken", replace(plain, broken=True)),
        ("used up", replace(plain, used_up=True)),
    ):
        now = build(other)
        same = now.keys() == drawn.keys() and all(
            np.array_equal(patch.vertices, drawn[m].vertices)
            and np.array_equal(patch.colours, drawn[m].colours)
            for m, patch in now.items()
        )
        if not same:
            yield name, other


def portrait(look: Appearance, side: int = _SIDE, yaw: float = 30.0) -> NDArray[np.uint8]:
    """(S, S, 3) a thing by itself, seen from its front, ``yaw`` degrees aside, and from above."""
    root = core().NodePath("portrait")
    root.attachNewNode(geometry(pieces_of_look(look, 0.0), 1, look.kind))
    corners = np.concatenate([patch.vertices for patch in build(look).values()])
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    away = max(radius / np.sin(np.radians(20)), 0.12 + radius)
    heading, down = np.radians(180.0 + yaw), np.radians(22.0)
    ahead = np.array(
        [np.sin(heading) * np.cos(down), -np.sin(down), np.cos(heading) * np.cos(down)]
    )
    frames = rasteriser().draw(
        root, Camera(middle - away * ahead, 180.0 + yaw, 22.0, 42.0, side, side)
    )
    nothing = (frames.ids == 0) & (frames.rgb.sum(axis=2) == 0)
    frames.rgb[nothing] = 228
    return frames.rgb


def room_views(scene_name: str) -> list[NDArray[np.uint8]]:
    """The two views of a room that show the most different objects."""
    world, cameras = _views(scene_name)
    views = [replace(camera, width=_ROOM[0], height=_ROOM[1]) for camera in cameras]
    return [scene_graph_of(scene_name).draw(world, camera).rgb for camera in views]


def _views(scene_name: str) -> tuple[World, list[Camera]]:
    """A room, and where its two views are taken from."""
    world = World.load(load_scene(scene_name), Settings())
    y = world.agent.position[1]
    found: list[tuple[int, int, float, Camera]] = []
    for k, (x, z) in enumerate(world.scene.reachable[::4]):
        for yaw in np.arange(0.0, 360.0, 45.0):
            camera = Camera(Agent(np.array([x, y, z])).camera, float(yaw), 15.0, 75.0, 96, 60)
            ids = scene_graph_of(scene_name).draw(world, camera).ids
            counts = np.bincount(ids.ravel(), minlength=2)[1:]
            found.append((int((counts > 8).sum()), -k, float(yaw), camera))
    found.sort(key=lambda view: view[:3], reverse=True)
    first = found[0]
    second = next(view for view in found if abs((view[2] - first[2] + 180) % 360 - 180) > 80)
    return world, [first[3], second[3]]


def _in_both_lights(scene_name: str) -> NDArray[np.uint8]:
    """A view of a room in flat light, and in soft light beside it."""
    world, (camera, _) = _views(scene_name)
    view = replace(camera, width=_PAIR[0], height=_PAIR[1])
    pictures = [scene_graph_of(scene_name, light).draw(world, view).rgb for light in (FLAT, SOFT)]
    return np.concatenate(pictures, axis=1)


def _light_pages(images: Path) -> list[str]:
    """The lines about light, and their pictures."""
    lines = [
        "## Light: twelve rooms, flat on the left and soft on the right",
        "",
        "Soft light comes from the windows (where there are none, from the ceiling) and from lamps",
        'that are on, and things stand in soft shadows. `light="flat"` turns it off.',
        "",
    ]
    for kind, numbers in track(_LIT.items(), "light", transient=True):
        scenes = [f"FloorPlan{number}" for number in numbers]
        page = Image.fromarray(np.concatenate([_in_both_lights(scene) for scene in scenes]))
        name, title = f"gallery-light-{kind.replace('_', '-')}.jpg", kind.replace("_", " ")
        write_picture(images / name, page, force=True, quality=80)
        told = ", ".join(scenes)
        lines += [f"![{title.capitalize()} in both lights: {told}](images/{name})", ""]
    return lines


def make_gallery() -> None:
    """Write docs/gallery.md and its pictures, which are the repository's own."""
    images = DOCS / "images"
    things = [
        (kind, portrait(found[0]))
        for kind in track(sorted(SHAPES), "things", transient=True)
        if (found := looks(kind))  # the doors of houses are in no recorded room
    ]
    write_picture(images / "gallery-things.png", sheet(things, _COLUMNS), force=True, optimize=True)
    lines = [
        "# Gallery",
        "",
        "Pictures of the embedded engine, made by `python -m benchmarks.pages.gallery`.",
        "",
        f"## Things: the {len(things)} types",
        "",
        "![Every type of object beside its name](images/gallery-things.png)",
        "",
    ]
    front = Image.new("RGB", (2 * _ROOM[0], 2 * _ROOM[1]))
    for number, (kind, numbers) in enumerate(track(_ROOMS.items(), "rooms", transient=True)):
        scenes = [f"FloorPlan{number}" for number in numbers]
        assert all(number in SCENE_NUMBERS[kind] for number in numbers)
        views = [view for scene in scenes for view in room_views(scene)]
        place = number % 2 * _ROOM[0], number // 2 * _ROOM[1]
        front.paste(Image.fromarray(views[_IN_FRONT[kind]]), place)
        page = Image.new("RGB", (2 * _ROOM[0], len(scenes) * _ROOM[1]))
        for k, view in enumerate(views):
            page.paste(Image.fromarray(view), (k % 2 * _ROOM[0], k // 2 * _ROOM[1]))
        name = kind.replace("_", "-")
        write_picture(images / f"gallery-{name}.jpg", page, force=True, quality=85)
        title = kind.replace("_", " ").capitalize()
        lines += [
            f"## {title}: {' and '.join(scenes)}",
            "",
            f"![{title}](images/gallery-{name}.jpg)",
            "",
        ]
    small = front.resize((1000, 625), Image.Resampling.LANCZOS)
    write_picture(images / "rooms.jpg", small, force=True, quality=88)
    lines += _light_pages(images)
    lines += house_pages(images)
    write_output(DOCS / "gallery.md", MARKDOWN_MARK + "\n".join(lines), force=True)


@click.command()
@click.option(
    "--kinds", default="", help="Object types, separated by commas, for one contact sheet."
)
@click.option("--states", "with_states", is_flag=True, help="Show each visible state.")
@click.option("--count", default=2, show_default=True, help="Objects of each type.")
@click.option("--columns", default=8, show_default=True)
@click.option("--yaw", default=30.0, show_default=True, help="Degrees from the front.")
@click.option("--out", default="contact.png", show_default=True, type=click.Path(path_type=Path))
@force_option
def main(
    kinds: str, with_states: bool, count: int, columns: int, yaw: float, out: Path, force: bool
) -> None:
    """Make the gallery, or one contact sheet."""
    wanted = [kind.strip() for kind in kinds.split(",") if kind.strip()]
    if not wanted:
        make_gallery()
        return
    unknown = [kind for kind in wanted if kind not in SHAPES]
    if unknown:
        raise click.BadParameter(
            f"no shape for {', '.join(unknown)}; there are: {', '.join(sorted(SHAPES))}"
        )
    with bad_input():
        picture_format(out)
        check_output(out, force=force)
    pictures = []
    for kind in wanted:
        for look in looks(kind, count):
            for name, shown in states(look) if with_states else [("", look)]:
                pictures.append((f"{kind} {name}".strip(), portrait(shown, yaw=yaw)))
    with bad_input():
        write_picture(out, sheet(pictures, columns), force=force)


if __name__ == "__main__":
    main()
