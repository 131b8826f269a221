"""The doors of houses."""

from __future__ import annotations

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.registry import shape

_CASING, _LEAF = 0.07, 0.04
"""Width of the casing, and thickness of the leaf, metres."""
_WHITE: Colour = (0.94, 0.93, 0.90)
_BRASS: Colour = (0.80, 0.66, 0.36)


@shape("Doorframe")
def doorframe(look: Appearance) -> Mesh:
    """A casing around a hole."""
    mesh, (w, h, d) = Mesh(), look.size
    for x in (-1, 1):
        mesh.box((x * (w - _CASING) / 2, h / 2, 0.0), (_CASING, h, d), _WHITE)
    mesh.box((0.0, h - _CASING / 2, 0.0), (w - 2 * _CASING, _CASING, d), shaded(_WHITE, 0.97))
    return mesh


@shape("Doorway")
def doorway(look: Appearance) -> Mesh:
    """A casing, and a leaf with two fields unless the door stands open."""
    mesh, (w, h, _) = doorframe(look), look.size
    if look.openness > 0.0:
        return mesh
    panel = mixed(look.palette.wood, _WHITE, 0.15)
    inner, tall = w - 2 * _CASING, h - _CASING
    mesh.box((0.0, tall / 2, 0.0), (inner, tall, _LEAF), panel, "wood")
    for low, high in ((0.06 * tall, 0.45 * tall), (0.53 * tall, 0.93 * tall)):
        for z in (-1, 1):
            middle = (0.0, (low + high) / 2, z * (_LEAF / 2 + 0.004))
            mesh.box(middle, (inner - 0.24, high - low, 0.008), shaded(panel, 0.85), "wood")
    for z in (-1, 1):
        mesh.ball((inner / 2 - 0.07, 0.48 * h, z * 0.05), (0.06, 0.06, 0.06), _BRASS)
    return mesh
