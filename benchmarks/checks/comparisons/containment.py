"""Compares the receptacles of objects, from geometry alone, with the recorded ones."""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.world import World


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
    for name in SCENE_NAMES:
        world = World.load(load_scene(name), Settings())
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
