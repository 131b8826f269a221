"""Checks that a picture depends only on the state of the world, not on earlier pictures.

    python -m benchmarks.checks.one_picture [--states 500] [--processes 3]

A state is a recipe: a room, a random arrangement, things opened, switched, sliced, dirtied, broken,
filled, moved or held, a pose, and in some a third-party camera. Several histories lead to it in
this process (see ``HISTORIES``); fresh processes, with other values of PYTHONHASHSEED, reach the
states directly and in another order. Each is drawn at 300×300 and 800×450. Pictures, instance
masks, class masks and depth must be equal to the byte wherever the metadata are.

Prints the number of pictures compared and each difference; the exit code is 1 if there is one.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import click
import numpy as np

from er_gym.sim.engine import Engine
from er_gym.sim.render.view import View
from er_gym.sim.scene import SCENE_NUMBERS
from er_gym.thor import SCENE_NAMES

SIZES = ((300, 300), (800, 450))
_CHANGES = 12
"""The number of changes that a recipe tries; some are refused."""
_UNDO = {
    "OpenObject": "CloseObject",
    "CloseObject": "OpenObject",
    "ToggleObjectOn": "ToggleObjectOff",
    "ToggleObjectOff": "ToggleObjectOn",
    "DirtyObject": "CleanObject",
    "CleanObject": "DirtyObject",
    "FillObjectWithLiquid": "EmptyLiquidFromObject",
}
"""The action that undoes each action."""
_FOR_GOOD = {
    "openable": ("OpenObject",),
    "toggleable": ("ToggleObjectOn", "ToggleObjectOff"),
    "sliceable": ("SliceObject",),
    "dirtyable": ("DirtyObject", "CleanObject"),
    "breakable": ("BreakObject",),
    "canFillWithLiquid": ("FillObjectWithLiquid",),
    "cookable": ("CookObject",),
    "canBeUsedUp": ("UseUpObject",),
}
"""The actions of a recipe, by the property of an object that allows them."""

Request = dict[str, Any]
Digests = dict[str, str]
"""Name of a picture, such as ``"300x300 rgb"``, to a digest of its bytes."""


class Replayer:
    """Replays requests on an engine and digests its pictures.

    Args:
        engine: may have been used before.
    """

    def __init__(self, engine: Engine | None = None) -> None:
        self.engine = engine or Engine()

    def do(self, request: Request, draw: bool = False) -> bool:
        """Do an action, with or without drawing the result; returns whether it succeeded."""
        metadata, _ = self.engine.step({"renderImage": draw, **request})
        return bool(metadata["lastActionSuccess"])

    @property
    def objects(self) -> list[dict[str, Any]]:
        """The metadata of all objects."""
        objects: list[dict[str, Any]] = self._said()["objects"]
        return objects

    def _said(self) -> Mapping[str, Any]:
        return self.engine.step({"action": "Pass", "renderImage": False})[0]

    def state(self) -> str:
        """A digest of all metadata."""
        said = self._said()
        kept = {
            name: said[name]
            for name in ("sceneName", "agent", "heldObjectPose", "fov", "thirdPartyCameras")
            if name in said
        }
        kept["objects"] = sorted((dict(each) for each in said["objects"]), key=lambda o: o["name"])
        return _digest(json.dumps(kept, sort_keys=True, default=str).encode())

    def pictures(self) -> dict[str, np.ndarray]:
        """Everything that can be drawn of the state, by name, at both sizes."""
        found = {}
        for width, height in SIZES:
            self.do({"action": "ChangeResolution", "x": width, "y": height})
            self.engine.world.configure(render_depth=True)
            _, view = self.engine.step(
                {
                    "action": "Pass",
                    "renderInstanceSegmentation": True,
                    "renderSemanticSegmentation": True,
                }
            )
            assert view is not None
            for name, picture in _named(view):
                found[f"{width}x{height} {name}"] = picture
        self.do({"action": "ChangeResolution", "x": SIZES[0][0], "y": SIZES[0][1]})
        return found


def _named(view: View, camera: str = "") -> Iterator[tuple[str, np.ndarray]]:
    for name in ("rgb", "depth", "instances", "classes"):
        yield camera + name, getattr(view, name)
    for number, other in enumerate(view.third_party):
        yield from _named(other, f"camera {number} ")


def _digest(content: bytes) -> str:
    return blake2b(content, digest_size=12).hexdigest()


# -- states ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Recipe:
    """A state, as the requests that reach it from a fresh world.

    Attributes:
        number: of the state. scene: the room. requests: AI2-THOR actions, all of which succeed.
    """

    number: int
    scene: str
    requests: tuple[Request, ...]


def recipe(number: int) -> Recipe:
    """State ``number``: the same in every process."""
    random = np.random.default_rng([15, number])
    kinds = list(SCENE_NUMBERS)
    scene = f"FloorPlan{random.choice(SCENE_NUMBERS[kinds[number % len(kinds)]])}"
    replayer, requests = Replayer(), []
    replayer.do({"action": "Reset", "sceneName": scene})

    def try_out(request: Request) -> bool:
        done = replayer.do(request)
        if done:
            requests.append(request)
        return done

    grid = float(random.choice([0.25, 0.1]))
    try_out(
        {"action": "Initialize", "gridSize": grid, "fieldOfView": int(random.integers(60, 110))}
    )
    if random.random() < 0.5:
        try_out({"action": "InitialRandomSpawn", "randomSeed": int(random.integers(1000))})
    for _ in range(_CHANGES):
        try_out(_change(random, replayer.objects))
    try_out(_pose(random, scene, replayer))
    if random.random() < 0.4:
        carried = [each["objectId"] for each in replayer.objects if each["pickupable"]]
        chosen = str(random.choice(carried))
        try_out({"action": "PickupObject", "objectId": chosen, "forceAction": True})
        try_out(_pose(random, scene, replayer))
    if random.random() < 0.3:
        x, y, z = replayer.engine.world.agent.position.tolist()
        try_out(
            {
                "action": "AddThirdPartyCamera",
                "position": {"x": x + random.uniform(-1, 1), "y": y + 0.5, "z": z},
                "rotation": {"x": 20.0, "y": random.uniform(0, 360), "z": 0.0},
                "fieldOfView": 75.0,
            }
        )
    return Recipe(number, scene, tuple(requests))


def _change(random: np.random.Generator, objects: list[dict[str, Any]]) -> Request:
    """A random action on a random object that allows it."""
    able = [p for p in _FOR_GOOD if any(each[p] for each in objects)]
    wanted = str(random.choice(able))
    things = [each["objectId"] for each in objects if each[wanted]]
    request: Request = {
        "action": str(random.choice(_FOR_GOOD[wanted])),
        "objectId": str(random.choice(things)),
        "forceAction": True,
    }
    if request["action"] == "OpenObject":
        request["openness"] = float(random.choice([1.0, 0.5, 0.3]))
    return request


def _pose(random: np.random.Generator, scene: str, replayer: Replayer) -> Request:
    floor = replayer.engine.world.scene.reachable
    x, z = floor[random.integers(len(floor))].tolist()
    return {
        "action": "TeleportFull",
        "x": x,
        "y": float(replayer.engine.world.standing_height),
        "z": z,
        "rotation": {"x": 0.0, "y": float(random.choice([0, 45, 90, 180, 270, 33.3])), "z": 0.0},
        "horizon": float(random.choice([-30, 0, 30, 60])),
        "standing": bool(random.random() < 0.8),
        "forceAction": True,
    }


def follow(wanted: Recipe, replayer: Replayer, draw: bool = False) -> None:
    """Bring a replayer into a state from a fresh world of its scene."""
    for request in ({"action": "Reset", "sceneName": wanted.scene}, *wanted.requests):
        done = replayer.do(request, draw)
        if not done:
            raise AssertionError(f"state {wanted.number}: {request} succeeded before, but not now")


# -- histories -------------------------------------------------------------------------------------


def straight(wanted: Recipe, replayer: Replayer) -> None:
    """Nothing is drawn on the way."""
    follow(wanted, replayer)


def after_another_room(wanted: Recipe, replayer: Replayer) -> None:
    """First a walk in another room, with pictures; then each action is drawn."""
    random = np.random.default_rng([1, wanted.number])
    replayer.do({"action": "Reset", "sceneName": str(random.choice(SCENE_NAMES))}, draw=True)
    for _ in range(4):
        replayer.do(_change(random, replayer.objects), draw=True)
        for action in random.choice(["MoveAhead", "RotateRight", "LookDown", "MoveBack"], 2):
            replayer.do({"action": str(action)}, draw=True)
    follow(wanted, replayer, draw=True)


def after_another_arrangement(wanted: Recipe, replayer: Replayer) -> None:
    """First the same room in another arrangement, with pictures."""
    random = np.random.default_rng([2, wanted.number])
    replayer.do({"action": "Reset", "sceneName": wanted.scene}, draw=True)
    seed = int(random.integers(1000))
    replayer.do({"action": "InitialRandomSpawn", "randomSeed": seed}, draw=True)
    for _ in range(4):
        replayer.do(_change(random, replayer.objects), draw=True)
        replayer.do(_pose(random, wanted.scene, replayer), draw=True)
    follow(wanted, replayer, draw=True)


def there_and_back(wanted: Recipe, replayer: Replayer) -> None:
    """From the state into others and back: walks, opens and shuts, switches, fills and empties."""
    random = np.random.default_rng([3, wanted.number])
    follow(wanted, replayer, draw=True)
    agent = replayer.engine.world.agent
    back = {
        "action": "TeleportFull",
        **dict(zip("xyz", agent.position.tolist(), strict=True)),
        "rotation": {"x": 0.0, "y": agent.rotation, "z": 0.0},
        "horizon": agent.horizon,
        "standing": agent.standing,
        "forceAction": True,
    }
    undone: list[Request] = []
    for _ in range(6):
        openness = {each["objectId"]: each["openness"] for each in replayer.objects}
        change = _change(random, replayer.objects)
        other = _UNDO.get(change["action"])
        if other is None or not replayer.do(change, draw=True):
            continue
        name = change["objectId"]
        undo = {"action": other, "objectId": name, "forceAction": True}
        if change["action"] == "OpenObject" and openness[name] > 0.0:
            undo |= {"action": "OpenObject", "openness": openness[name]}
        undone.append(undo)
        for action in random.choice(["MoveAhead", "RotateLeft", "LookUp", "MoveLeft"], 2):
            replayer.do({"action": str(action)}, draw=True)
    for undo in reversed(undone):
        replayer.do(undo, draw=True)
    if not replayer.do(back, draw=True):
        raise AssertionError(f"state {wanted.number}: no way back to {back}")


HISTORIES: tuple[Callable[[Recipe, Replayer], None], ...] = (
    straight,
    after_another_room,
    after_another_arrangement,
    there_and_back,
)
"""Ways into a state."""


def set_down(
    wanted: Recipe, replayer: Replayer, by: Callable[[Recipe, Replayer], None], away: float
) -> None:
    """A state; then all pickupable objects go ``away`` metres, turn, and return. An object that has
    been set down differs from the recorded one, since AI2-THOR's boxes do not quite fit its own
    poses. So two such ways are compared with each other.
    """
    by(wanted, replayer)
    poses = [
        {"objectName": each["name"], "position": each["position"], "rotation": each["rotation"]}
        for each in replayer.objects
        if each["pickupable"] or each["moveable"]
    ]
    moved = [
        {
            **pose,
            "position": {**pose["position"], "x": pose["position"]["x"] + away},
            "rotation": {**pose["rotation"], "y": pose["rotation"]["y"] + 90.0 * away},
        }
        for pose in poses
    ]
    for several in (moved, poses):
        if not replayer.do({"action": "SetObjectPoses", "objectPoses": several}, draw=True):
            raise AssertionError(f"state {wanted.number}: objects cannot be set down")
        replayer.do({"action": "RotateRight"}, draw=True)
        replayer.do({"action": "RotateLeft"}, draw=True)


# -- comparing -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Snapshot:
    """A state as it was reached: a digest of its metadata, and its pictures by name."""

    state: str
    pictures: Mapping[str, np.ndarray]

    @staticmethod
    def by(replayer: Replayer) -> Snapshot:
        """The present state of a replayer."""
        return Snapshot(replayer.state(), replayer.pictures())

    @property
    def digests(self) -> Digests:
        """All of it as digests."""
        return {
            "state": self.state,
            **{name: _digest(picture.tobytes()) for name, picture in self.pictures.items()},
        }

    def differences(self, other: Snapshot) -> Iterator[tuple[str, int]]:
        """The pictures that differ, and in how many pixels."""
        for name, picture in self.pictures.items():
            if picture.tobytes() != other.pictures[name].tobytes():
                apart = (picture != other.pictures[name]).reshape(*picture.shape[:2], -1)
                yield name, int(apart.any(axis=2).sum())


def _fresh(states: list[int], hash_seed: int) -> dict[int, Digests]:
    """The digests of some states from a fresh process, which reaches them in another order."""
    order = np.random.default_rng(hash_seed).permutation(states).tolist()
    result = subprocess.run(
        [sys.executable, "-m", "benchmarks.checks.one_picture", "--say"],
        input=json.dumps(order),
        env={**os.environ, "PYTHONHASHSEED": str(hash_seed)},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    return {int(number): found for number, found in json.loads(result.stdout).items()}


class Differences:
    """The number of comparisons, and the differences."""

    def __init__(self) -> None:
        self.counts = Counter[str]()
        self.apart = 0

    def compare(self, what: str, wanted: Recipe, one: Snapshot, other: Snapshot) -> None:
        """Compare two ways to a state; if they led to different states, the pictures may differ."""
        if one.state != other.state:
            self.counts[f"{what}: another state"] += 1
            return
        self.counts[f"{what}: the same state"] += 1
        self.counts["pictures"] += len(one.pictures)
        for name, pixels in one.differences(other):
            self.differs(f"state {wanted.number} ({wanted.scene}), {what}: {name}: {pixels} pixels")

    def differs(self, what: str) -> None:
        """Add a difference."""
        self.apart += 1
        click.echo(what)


@click.command()
@click.option("--states", default=500, show_default=True, type=click.IntRange(1))
@click.option("--processes", default=3, show_default=True, type=click.IntRange(0))
@click.option("--say", is_flag=True, hidden=True)
def main(states: int, processes: int, say: bool) -> None:
    """Reach random states in several ways and compare what is drawn."""
    if say:
        _say()
        return
    found, said = Differences(), {}
    players = {by: Replayer() for by in HISTORIES}
    for number in range(states):
        wanted = recipe(number)
        reached = {}
        for by, replayer in players.items():
            by(wanted, replayer)
            reached[by] = Snapshot.by(replayer)
            if by is not straight:
                found.compare(by.__name__, wanted, reached[straight], reached[by])
        said[number] = reached[straight].digests
        ends = []
        for by, away in ((straight, 0.3), (after_another_arrangement, -0.7)):
            set_down(wanted, players[by], by, away)
            ends.append(Snapshot.by(players[by]))
        found.compare("set down", wanted, *ends)
    for hash_seed in range(1, processes + 1):
        for number, told in _fresh(list(range(states)), hash_seed).items():
            found.counts["pictures of fresh processes"] += len(told) - 1
            for name in told:
                if told[name] != said[number][name]:
                    found.differs(f"state {number}, fresh process {hash_seed}: {name}")
    for name, count in found.counts.items():
        click.echo(f"{count:6d} {name}")
    click.echo(f"{found.apart:6d} differences in {states} states")
    sys.exit(1 if found.apart else 0)


def _say() -> None:
    """The work of a fresh process: reads numbers of states, and prints their digests as JSON."""
    found, replayer = {}, Replayer()
    for number in json.load(sys.stdin):
        follow(recipe(number), replayer)
        found[number] = Snapshot.by(replayer).digests
    print(json.dumps(found))


if __name__ == "__main__":
    main()
