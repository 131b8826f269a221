"""Rooms are drawn from what is kept on disk as they are from what is made anew."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from er_gym.sim import source_key as key_module
from er_gym.sim.render import bake as bake_module
from er_gym.sim.render import nodes
from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.bake import bake_of
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.scene_graph import SceneGraph
from er_gym.sim.render.shapes import SHAPES
from tests.sim.render.test_scene_graph import camera_of, do, one, stand, world_of

ROOM = "FloorPlan1"


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    _forget()
    yield
    _forget()


def _forget() -> None:
    bake_of.cache_clear()
    for each in (nodes.made_node, nodes.recorded_node, nodes.room_node, nodes._pieces):
        each.cache_clear()


def _files(folder: Path) -> list[Path]:
    return sorted(folder.glob("er-gym/*/*.bake"))


def _pictures() -> list[np.ndarray]:
    """A room as recorded, with its fridge open, and with an apple in the hand."""
    found = []
    for change in ("", "OpenObject", "PickupObject"):
        world = world_of(ROOM)
        thing = world.object_ids[one(world, "Fridge" if change == "OpenObject" else "Apple")]
        if change:
            do(world, change, objectId=thing, forceAction=True)
        stand(world, -1.0, 1.0, 270.0, 20.0)
        frames = SceneGraph(ROOM).draw(world, camera_of(world))
        found += [frames.rgb, frames.ids]
    return found


def test_a_room_out_of_the_cache_is_the_one_that_was_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = _pictures()
    (file,) = _files(tmp_path)
    _forget()
    with monkeypatch.context() as patch:
        patch.setattr(bake_module, "_made", None)  # it is not made again
        patch.setattr(nodes, "pieces_of_look", _only_of_what_is_open)
        assert all(map(np.array_equal, _pictures(), made))
    for spoilt in (b"", file.read_bytes()[:-1], file.read_bytes()[:-1] + b"?"):
        file.write_bytes(spoilt)
        _forget()
        assert all(map(np.array_equal, _pictures(), made))
        assert file.read_bytes() != spoilt


def _only_of_what_is_open(seen: Appearance, heading: float) -> object:
    assert seen.kind == "Fridge", "the others look as recorded"
    return bake_module.pieces_of_look(seen, heading)


def test_without_a_cache_rooms_are_drawn_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = _pictures()
    blocked = tmp_path / "file"
    blocked.write_bytes(b"")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    _forget()
    assert all(map(np.array_equal, _pictures(), made))
    assert blocked.read_bytes() == b""


def test_another_source_makes_rooms_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = tmp_path / "source"
    (source / "data").mkdir(parents=True)
    (source / "shapes.py").write_text("SIDE = 1\n")
    monkeypatch.setattr(key_module, "_HERE", source)
    keys = set()
    for name, text in (("shapes.py", "SIDE = 2\n"), ("new.py", ""), ("data/types.json", "{}")):
        keys.add(key_module.source_key.__wrapped__())
        (source / name).write_text(text)
    keys.add(key_module.source_key.__wrapped__())
    assert len(keys) == 4
    for key in keys:
        monkeypatch.setattr(bake_module, "source_key", lambda key=key: key)
        bake_of.cache_clear()
        bake_of(ROOM)
    assert len(_files(tmp_path)) == 4


def test_a_shape_that_another_package_adds_is_not_out_of_the_cache(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = _pictures()

    def fridge(seen: Appearance) -> Mesh:
        mesh = Mesh()
        mesh.box((0.0, seen.size[1] / 2, 0.0), seen.size, (1.0, 0.0, 0.0))
        return mesh

    monkeypatch.setitem(SHAPES, "Fridge", fridge)
    _forget()
    bake_module.build.cache_clear()
    after = _pictures()
    bake_module.build.cache_clear()
    assert (before[0] != after[0]).any()
    assert ((after[0] > 60) & (after[0][..., 2:] < 10)).any()
