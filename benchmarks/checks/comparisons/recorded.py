"""Compares the embedded engine with what its packaged scene tables hold of AI2-THOR's scenes.

The receptacles of objects, from geometry alone; the poses from which AI2-THOR opened things; and
random placements, which must overlap nothing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from er_gym.sim.actions.pick_place import put_down
from er_gym.sim.agent import Agent
from er_gym.sim.placement_restrictions import accepts
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.interactable_poses import interactable_poses
from er_gym.sim.space.placement import free_spots, is_vessel, surface_height
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.space.recorded_floor import RECORDED_STEP
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

_TOUCH = 0.005


def _worlds() -> Iterator[World]:
    return (World.load(load_scene(name), Settings()) for name in SCENE_NAMES)


@dataclass(frozen=True)
class Containment:
    """Counts of pickupable objects over the 120 scenes.

    Attributes:
        objects: all of them.
        innermost: those whose innermost receptacle, worked out, is one that the record names; or
            neither has any.
        all_of_them: those for which the two name the same receptacles.
    """

    objects: int
    innermost: int
    all_of_them: int


def containment(lift: float = 0.0) -> Containment:
    """Compare; ``lift`` raises each object by so many metres, for a comparison that has to fail."""
    objects = innermost = all_of_them = 0
    for world in _worlds():
        for i in range(len(world)):
            if not world.has(i, "pickupable"):
                continue
            world.low[i, 1] += lift
            world.high[i, 1] += lift
            found, recorded = receptacles_of(world, i), set(world.parents[i])
            world.low[i, 1] -= lift
            world.high[i, 1] -= lift
            objects += 1
            innermost += found[0] in recorded if found else not recorded
            all_of_them += set(found) == recorded
    return Containment(objects, innermost, all_of_them)


def openable_poses(turn: float = 0.0) -> dict[str, tuple[int, int]]:
    """Type to (how many entries agree, how many there are), over the 120 scenes.

    An entry agrees when the object is interactable from its pose, or one within a step of the
    grid with the same rotation and horizon is among the object's interactable poses: agent
    standing, visibility distance 1.5 m, field of view 90 degrees.

    Args:
        turn: degrees to turn the recorded headings by, for a comparison that has to fail.
    """
    found: dict[str, tuple[int, int]] = {}
    for world in _worlds():
        height = world.agent.position[1]
        for i, pose in world.scene.openable_poses.items():
            rotation = pose.rotation + turn
            here = np.array([pose.x, height, pose.z])
            agrees = bool(visible(world, Agent(here, rotation, pose.horizon))[i])
            if not agrees:
                gaps = np.linalg.norm(world.scene.reachable - here[[0, 2]], axis=1)
                near = world.scene.reachable[gaps <= RECORDED_STEP + 1e-6]
                agrees = bool(
                    interactable_poses(world, i, near, [rotation], [pose.horizon], [True], 1).size
                )
            agreed, entries = found.get(world.types[i], (0, 0))
            found[world.types[i]] = agreed + agrees, entries + 1
    return found


@dataclass
class Placements:
    """The results of putting random objects into random receptacles that accept them.

    Attributes:
        tried, placed: how many; a receptacle may be full.
        clashes: (scene, thing, receptacle, what it runs into) for overlaps of more than 5 mm.
        out_of_order: (scene, thing, receptacle) where a spot in the agent's picture came after one
            that is not, or a nearer one after a farther one, vessels aside.
    """

    tried: int = 0
    placed: int = 0
    clashes: list[tuple[str, str, str, str]] = field(default_factory=list)
    out_of_order: list[tuple[str, str, str]] = field(default_factory=list)


def random_placements(each: int, seed: int = 0) -> Placements:
    """Put ``each`` things in each of the 120 scenes, one after the other, by a seed."""
    random, found = np.random.default_rng(seed), Placements()
    for world in _worlds():
        things = [i for i in range(len(world)) if world.has(i, "pickupable")]
        receptacles = [r for r in range(len(world)) if world.has(r, "receptacle")]
        for _ in range(each):
            i = int(random.choice(things))
            taking = [
                r
                for r in receptacles
                if r != i
                and accepts(world.types[i], world.types[r])
                and i not in world.ancestors(r)
            ]
            if taking:
                x, z = random.choice(world.scene.reachable)
                agent = Agent(np.array([x, world.agent.position[1], z]), 90.0 * random.integers(4))
                _put(world, i, int(random.choice(taking)), agent, found)
    return found


def _put(world: World, i: int, receptacle: int, agent: Agent, found: Placements) -> None:
    names = world.scene.name, world.object_ids[i], world.object_ids[receptacle]
    near = agent.position[[0, 2]]
    spots = list(free_spots(world, i, receptacle, near, seen_by=agent))
    found.tried += 1
    if not spots:
        return
    found.placed += 1
    put_down(world, i, *spots[0], [receptacle])
    found.clashes += [(*names, world.object_ids[k]) for k in clashes(world, i, receptacle)]
    # Higher than where things stand are spots on top of a heap, which come last.
    base = surface_height(world, receptacle)
    feet = np.array([foot for _, foot in spots if abs(foot[1] - base) < 1e-9]).reshape(-1, 3)
    if not is_vessel(world, receptacle) and not _in_order(world, agent, feet):
        found.out_of_order.append(names)


def _in_order(world: World, agent: Agent, feet: np.ndarray) -> bool:
    """Whether spots in the picture come before the others, and the nearer ones first in each."""
    unseen = ~_in_view(world, agent, feet)
    gaps = np.hypot(*(feet - agent.position)[:, [0, 2]].T)
    return bool((np.diff(unseen + 1e-3 * gaps) > -1e-9).all())


def clashes(world: World, i: int, receptacle: int) -> list[int]:
    """What object i overlaps by more than a touch, whichever way one looks.

    Loose and moveable things count, the loose ones by their oriented boxes, less those that it lies
    in and the furniture that its receptacle is part of, as a drawer is of a dresser.
    """
    middle = (world.low[receptacle] + world.high[receptacle]) / 2
    aside = {i, *world.inside(i), *world.ancestors(i)}
    found = []
    for k in np.flatnonzero(world.exists).tolist():
        around = (world.low[k] <= middle).all() and (middle <= world.high[k]).all()
        if k in aside or (around and not world.has(k, "pickupable")):
            continue
        if world.has(k, "pickupable"):
            boxes = np.array([[world.low[k], world.high[k]]])
        elif world.has(k, "moveable"):
            boxes = solid_of(world, k).boxes
        else:
            continue
        depth = np.minimum(boxes[:, 1], world.high[i]) - np.maximum(boxes[:, 0], world.low[i])
        if (depth > _TOUCH).all(axis=1).any() and not (
            world.has(k, "pickupable") and _apart(world, i, k)
        ):
            found.append(k)
    return found


def _apart(world: World, i: int, k: int) -> bool:
    """Whether a plumb line on the floor plan parts the oriented boxes of two things, but for a
    touch: one that runs along an edge of either."""
    plans = [corners[:, [0, 2]] for j in (i, k) if (corners := world.obb_corners(j)) is not None]
    if len(plans) < 2:
        return False
    for plan in plans:
        for edge in plan[[1, 3, 4]] - plan[0]:
            across = np.array([-edge[1], edge[0]])
            length = np.linalg.norm(across)
            if length > _TOUCH:
                one, other = (corners @ across / length for corners in plans)
                if min(one.max(), other.max()) - max(one.min(), other.min()) <= _TOUCH:
                    return True
    return False


def _in_view(world: World, agent: Agent, points: np.ndarray) -> np.ndarray:
    """Which points are in the agent's picture, worked out here from the angles to them."""
    right, up, ahead = (points - agent.camera).T
    yaw = np.radians(agent.rotation)
    forward = right * np.sin(yaw) + ahead * np.cos(yaw)
    aside = right * np.cos(yaw) - ahead * np.sin(yaw)
    half = np.tan(np.radians(world.settings.field_of_view) / 2)
    return (forward > 0.1) & (abs(aside) <= forward * half) & (abs(up) <= forward * half)
