"""What things look like: one file a family, one short function a shape.

A shape is a function from a :class:`~er_gym.sim.render.appearance.Appearance` to a
:class:`~er_gym.sim.render.mesh.Mesh` that fills the look's size, registered for one object type or
several. :data:`SHAPES` is the table.
"""

from er_gym.sim.render.shapes import (  # noqa: F401  (each registers its shapes)
    appliances,
    bathroom,
    bedding,
    cleaning,
    cutlery,
    decor,
    electronics,
    food,
    hangings,
    lamps,
    leisure,
    seating,
    stationery,
    storage,
    tables,
    tableware,
    textiles,
    toiletries,
)
from er_gym.sim.render.shapes.registry import SHAPES, UNSEEN, build, without_shape

__all__ = ["SHAPES", "UNSEEN", "build", "without_shape"]
