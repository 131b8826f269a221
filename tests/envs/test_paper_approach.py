"""On which side of an object the paper's agent stands, by the direction that the object faces."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot, sqrt
from typing import Any

import pytest
from support import in_one_test, make_task

from er_gym.envs import paper_approach
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.paper_approach import (
    _FACING,
    ObjectSnapshot,
    Pose,
    _by_sides,
    _for_facing_north,
    _heading,
)
from er_gym.tasks.task import AgentPose

LITTLE, MIDDLING, LARGE = (0.1, 0.3), (0.5, 0.8), (3.0, 2.0)
"""Volumes and faces, m³ and m²."""
X, Z = 2.0, -1.0
"""Where the object is: east of the scene's origin and south of it."""
ROUND: Mapping[str, tuple[float, float]] = {
    "north": (0, 0.5),
    "north-east": (0.5, 0.5),
    "east": (0.5, 0),
    "south-east": (0.5, -0.5),
    "south": (0, -0.5),
    "south-west": (-0.5, -0.5),
    "west": (-0.5, 0),
    "north-west": (-0.5, 0.5),
}
"""Places around the object, metres to the east and to the north of it."""


def facing(degrees: float) -> ObjectSnapshot:
    return ObjectSnapshot(
        object_id="Fridge|1",
        object_type="Fridge",
        x=X,
        z=Z,
        rotation=degrees,
        centre=(X, 1.0, Z),
        top=2.0,
        receptacle=True,
        openable=True,
        is_toggled=False,
        contents=(),
    )


def at(*places: tuple[float, float]) -> list[Pose]:
    return [{"x": X + x, "y": 0.9, "z": Z + z} for x, z in places]


def sides_taken(degrees: float) -> list[tuple[str, float]]:
    """Where the agent stands and how it is turned; then, where it would if it could not; and so on
    until there is no place that it would take."""
    slanting = degrees % 90 != 0
    left = {name: place for name, place in ROUND.items() if ("-" in name) == slanting}
    taken = []
    while True:
        found, rotation = _by_sides(
            facing(degrees), at(*left.values()), _FACING[_heading(degrees)], LITTLE
        )
        if found is None:
            return taken
        place = (found["x"] - X, found["z"] - Z)
        name = next(name for name, each in left.items() if each == place)
        taken.append((name, rotation))
        del left[name]


@in_one_test(
    "row",
    [
        (45, [("north-east", 225), ("south-west", 45)]),
        (90, [("east", 270), ("west", 90)]),
        (
            135,
            [("south-east", 315), ("north-west", 135), ("north-east", 225), ("south-west", 45)],
        ),
        (180, [("south", 0)]),
        (225, [("south-west", 45), ("north-east", 225)]),
        (270, [("west", 90), ("east", 270)]),
        (315, [("north-west", 135), ("south-east", 315)]),
    ],
)
def test_in_front_first_then_behind_and_turned_to_the_object(
    row: tuple[float, list[tuple[str, float]]],
) -> None:
    """At 135 degrees the paper's agent also tries the sides, and at 180 it does not go behind."""
    degrees, expected = row
    assert sides_taken(degrees) == expected


def test_only_the_direction_ninety_looks_nowhere_else_if_places_in_front_are_too_far() -> None:
    for degrees, front in ((90, 1), (270, -1)):
        far, behind = (front * 1.2, 0.0), (front * -0.5, 0.0)
        found, _ = _by_sides(facing(degrees), at(far, behind), _FACING[degrees], LARGE)
        assert (found is None) == (degrees == 90)
        (only,) = at(behind)
        assert _by_sides(facing(degrees), [only], _FACING[degrees], LARGE)[0] == only


def test_a_place_in_line_is_taken_before_nearer_ones_aside() -> None:
    for degrees, line, aside in ((90, (0.7, 0.05), (0.3, 0.3)), (180, (0.05, -0.7), (0.3, -0.3))):
        found, _ = _by_sides(facing(degrees), at(aside, line), _FACING[degrees], LITTLE)
        assert [found] == at(line)
        alone, _ = _by_sides(facing(degrees), at(aside), _FACING[degrees], LITTLE)
        assert [alone] == at(aside)  # by a wider tolerance
        assert _by_sides(facing(degrees), at((0.6, -0.6)), _FACING[degrees], LITTLE)[0] is None


@in_one_test("row", [(LITTLE, 0.25), (MIDDLING, 0.5), (LARGE, 0.75)])
def test_how_near_depends_on_the_size(row: tuple[tuple[float, float], float]) -> None:
    size, expected = row
    places = at(*((away / sqrt(2), away / sqrt(2)) for away in (0.75, 0.25, 0.5, 1.25)))
    found, rotation = _by_sides(facing(45), places, _FACING[45], size)
    assert found is not None
    assert (round(hypot(found["x"] - X, found["z"] - Z), 6), rotation) == (expected, 225)


@in_one_test(
    "row",
    [  # the places in front and behind; which is taken; how the agent is turned there
        ((0.42, 0.48), 0.42, 0),  # turned as if it stood behind: the paper's program does so, too
        ((0.48, 0.42), -0.42, 0),
        ((0.5, 0.7), 0.5, 180),  # farther north or south than half a metre there is no place
        ((0.5, 0.5), -0.5, 0),
        ((0.5, None), 0.5, 180),
        ((None, 0.5), -0.5, 0),
        ((None, None), None, 180),
    ],
)
def test_of_both_sides_of_what_faces_north_the_nearer(
    row: tuple[tuple[float | None, float | None], float | None, float],
) -> None:
    (front, behind), expected, turned = row
    places = [(0.0, front)] if front else []
    places += [(0.0, -behind)] if behind else []
    found, rotation = _for_facing_north(facing(0), at(*places), None, LITTLE)
    assert (found and round(found["z"] - Z, 6), rotation) == (expected, turned)


def test_a_place_that_is_refused_is_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    env = EmbodiedEnv([], obs_mode="state", protocol="paper")
    task = make_task("single_pickup", navigable_objects=("CounterTop",))
    env.reset(options={"task": task})
    tried: list[AgentPose] = []
    go = paper_approach.teleport

    def refuses(controller: Any, pose: AgentPose) -> bool:
        tried.append(pose)
        return len(tried) > 3 and go(controller, pose)

    monkeypatch.setattr(paper_approach, "teleport", refuses)
    assert env.step("navigate to CounterTop")[4]["action_success"]
    assert len({(pose.x, pose.z) for pose in tried}) == len(tried) == 4
    assert (env.agent_pose.x, env.agent_pose.z) == (tried[-1].x, tried[-1].z)
    env.close()


def test_of_two_directions_equally_near_the_first_counts() -> None:
    directions = [0, 22, 22.6, 45.2, 67.4, 202, 337, 338, 359.9]
    assert [_heading(each) for each in directions] == [0, 0, 45, 45, 45, 180, 315, 0, 0]
