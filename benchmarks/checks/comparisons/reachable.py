"""Where the agent can stand: beside what AI2-THOR recorded, and what it gave as reachable.

Of AI2-THOR's positions at 0.1 m there is a sample (``unity_positions_dev.json`` of the shared
data), drawn at random in 80 scenes. It says directly how many of AI2-THOR's positions are ours. How
many of ours are AI2-THOR's follows from its density: on recorded floor that is clear of furniture,
which both agree on, there is one sampled position to so many; a set that is too large has fewer.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import astuple, dataclass
from operator import add
from pathlib import Path

import numpy as np

from er_gym.sim.scene import SCENE_NAMES, SCENE_NUMBERS, Scene, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.footprints import Footprints
from er_gym.sim.space.walkable_floor import Rules, compute_floor, floor_of
from er_gym.sim.world import World
from er_gym.thor import make_controller

FINE = 0.1
"""Spacing of AI2-THOR's positions, metres."""
POSITIONS = "unity_positions_dev.json"
BEFORE, LARGER = 79935, 1.4
"""How many positions this engine had when it filled in between the recorded ones only, and how many
times as many AI2-THOR has, by how often its random draws coincide."""
_DENSE = 30
"""Scenes with fewer sampled positions say nothing of density."""
_TOUCH = 0.01
_FOLDS = 5
_TRIED = [Rules(beyond, slack=slack) for beyond in (0.35, 0.45, 0.55) for slack in (0.0, 0.012)]
"""The rules among which each fold chooses."""
_KINDS = {f"FloorPlan{n}": kind for kind, numbers in SCENE_NUMBERS.items() for n in numbers}

Sample = Mapping[str, np.ndarray]
"""Scene to (P, 2) x, z positions that AI2-THOR gave as reachable, metres."""


@dataclass(frozen=True)
class Reachable:
    """Counts over the 120 scenes.

    Attributes:
        recorded: scenes whose recorded positions are all reachable at 0.25 m.
        connected: scenes whose positions at 0.1 m fall into no more pieces than the recorded ones.
        coarse, fine: positions at 0.25 m and at 0.1 m, all scenes together.
        outside: those at 0.1 m beyond the box of the Floor.
        in_furniture: those inside a part of the furniture that no recorded position is in.
    """

    recorded: int = 0
    connected: int = 0
    coarse: int = 0
    fine: int = 0
    outside: int = 0
    in_furniture: int = 0


def reachable() -> Reachable:
    """Count over the 120 scenes."""
    counts = np.zeros(6, dtype=int)
    controller = make_controller(headless=True)
    for name in SCENE_NAMES:
        scene = load_scene(name)
        controller.reset(name)
        coarse, fine = (_positions(controller, step) for step in (0.25, FINE))
        known = {tuple(place) for place in scene.reachable.tolist()}
        half = scene.aabb_size / 2
        floor = scene.types.index("Floor")
        low, high = (scene.aabb_center[floor] + sign * half[floor] for sign in (-1, 1))
        beyond = (fine < low[[0, 2]]) | (fine > high[[0, 2]])
        counts += (
            known <= {tuple(place) for place in coarse.tolist()},
            pieces(fine, FINE) <= pieces(scene.reachable, 0.25),
            len(coarse),
            len(fine),
            beyond.any(axis=1).sum(),
            _in_furniture(scene, fine),
        )
    controller.stop()
    return Reachable(*counts.tolist())


def _positions(controller: object, step: float) -> np.ndarray:
    controller.step(action="Initialize", gridSize=step)  # type: ignore[attr-defined]
    event = controller.step(action="GetReachablePositions")  # type: ignore[attr-defined]
    return np.array([(p["x"], p["z"]) for p in event.metadata["actionReturn"]])


def _in_furniture(scene: Scene, points: np.ndarray) -> int:
    """How many points are inside parts that no recorded position is in."""
    prints = Footprints.of(World.load(scene, Settings()))
    found = np.zeros(len(points), dtype=bool)
    for q in range(len(prints.reach)):
        if not (prints.gaps(q, *scene.reachable.T) < -_TOUCH).any():
            found |= prints.gaps(q, *points.T) < -_TOUCH
    return int(found.sum())


def pieces(points: np.ndarray, step: float) -> int:
    """How many parts a grid falls into when one walks between 4-neighbours only."""
    left = {tuple(node) for node in np.round(points / step).astype(int).tolist()}
    count = 0
    while left:
        count += 1
        todo = [left.pop()]
        while todo:
            x, z = todo.pop()
            for neighbour in ((x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)):
                if neighbour in left:
                    left.remove(neighbour)
                    todo.append(neighbour)
    return count


@dataclass(frozen=True)
class ReachableAgreement:
    """How far the positions of some scenes agree with AI2-THOR's.

    Attributes:
        given: sampled positions of AI2-THOR. found: those that are ours, too.
        ours: our positions in the scenes whose sample is dense.
        theirs: AI2-THOR's positions there, as the density of the sample has it.
    """

    given: int = 0
    found: int = 0
    ours: int = 0
    theirs: float = 0.0

    def __add__(self, other: ReachableAgreement) -> ReachableAgreement:
        return ReachableAgreement(*map(add, astuple(self), astuple(other)))

    @property
    def recall(self) -> float:
        return self.found / self.given

    @property
    def size(self) -> float:
        """Our positions as a multiple of AI2-THOR's."""
        return self.ours / self.theirs

    @property
    def f1(self) -> float:
        """With the precision that recall and size imply."""
        precision = min(1.0, self.recall / self.size)
        return 2 * precision * self.recall / (precision + self.recall)


def sample(positions_file: Path) -> Sample:
    """The positions of the shared data."""
    positions = json.loads(positions_file.read_text())["positions"]
    return {name: np.array(places) for name, places in positions.items()}


def agreement(name: str, given: np.ndarray, rules: Rules) -> ReachableAgreement:
    """Compare one scene under some rules."""
    ours = compute_floor(name, rules).grid(FINE, (0.0, 0.0))
    found = _nodes(given) & _nodes(ours)
    if len(given) < _DENSE:
        return ReachableAgreement(len(given), len(found))
    floor = floor_of(name)
    agreed = _nodes(ours[floor.is_certain(ours)])
    theirs = len(given) * len(agreed) / len(agreed & _nodes(given))
    return ReachableAgreement(len(given), len(found), len(ours), theirs)


def _nodes(points: np.ndarray) -> set[tuple[int, ...]]:
    return {tuple(node) for node in np.round(points / FINE).astype(int).tolist()}


def by_kind(agreed: Mapping[str, ReachableAgreement]) -> dict[str, ReachableAgreement]:
    """Sums over the scenes of each kind of room, and over all as ``"all"``."""
    found = dict.fromkeys([*SCENE_NUMBERS, "all"], ReachableAgreement())
    for name, of_scene in agreed.items():
        for kind in (_KINDS[name], "all"):
            found[kind] += of_scene
    return found


def agreements(given: Sample, rules: Rules) -> dict[str, ReachableAgreement]:
    """Compare all sampled scenes under some rules."""
    return {name: agreement(name, places, rules) for name, places in given.items()}


def held_out(given: Sample) -> dict[str, ReachableAgreement]:
    """Compare each scene under the rules that do best in the other folds' scenes."""
    tried = [agreements(given, rules) for rules in _TRIED]
    names = list(given)
    found = {}
    for fold in range(_FOLDS):
        left_out = set(names[fold::_FOLDS])
        best = max(tried, key=lambda each: _total(each, set(names) - left_out).f1)
        found.update({name: best[name] for name in left_out})
    return found


def _total(agreed: Mapping[str, ReachableAgreement], names: Iterable[str]) -> ReachableAgreement:
    return sum((agreed[name] for name in names), ReachableAgreement())
