"""What covers the squares of a picture."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from er_gym import EmbodiedEnv
from er_gym.data.cells import COLUMNS, ROWS, cells_of, on_grid
from er_gym.envs.perception import Perception
from er_gym.tasks.suites import load_suite
from er_gym.thor.objects import KIND_OF, TYPES


def seen(width: int, height: int) -> Perception:
    env = EmbodiedEnv((), obs_mode="rgb+instance", width=width, height=height)
    task = next(each for each in load_suite("mini").tasks if each.scene == "FloorPlan10")
    env.reset(options={"task": task})
    perception = env._current("looking").perception
    env.close()
    return perception


def test_each_square_names_what_is_there() -> None:
    perception = seen(200, 120)
    covers, cells = cells_of(perception)
    assert covers[0] == ""
    assert len(cells) == ROWS * COLUMNS
    names = [covers[int(each, 36)] for each in cells]
    objects, instances = perception.objects, perception.instances
    assert instances is not None
    checked = 0
    for place, name in enumerate(names):
        row, column = divmod(place, COLUMNS)
        square = instances[row * 10 : row * 10 + 10, column * 10 : column * 10 + 10]
        types = {"" if each == 0 else objects.type_of(each - 1) for each in np.unique(square)}
        types = {"" if each == "Floor" else each for each in types}
        assert name in types
        if len(types) == 1:
            assert {name} == types
            checked += bool(name)
    assert checked > 5
    assert len({*names}) > 5


def test_an_object_stands_for_a_square_before_the_room_does() -> None:
    """However little of the picture is the room, and whichever type comes first."""
    instances = np.ones((ROWS * 2, COLUMNS * 2), dtype=np.int64)
    instances[:2, :2] = [[0, 0], [0, 1]]  # three quarters of the first square are the room's
    for name in (TYPES[0], "Mug"):
        objects: Any = SimpleNamespace(kinds=np.array([KIND_OF[name]]))
        perception: Any = SimpleNamespace(instances=instances, objects=objects)
        assert cells_of(perception) == (("", name), "1" * ROWS * COLUMNS)


def test_another_grid_takes_the_rarest_thing_of_each_square() -> None:
    line = "0" * 4 + "1" * 12 + "2" + "1" * 3
    cells = line + "0" * COLUMNS * (ROWS - 1)
    assert on_grid(cells, 1, 5) == [0, 1, 1, 1, 2]
    assert on_grid(cells, ROWS, COLUMNS) == [int(each) for each in cells]
    # Squares that do not divide evenly overlap with more than their own.
    assert on_grid(cells, 1, 3) == [1, 1, 2]
