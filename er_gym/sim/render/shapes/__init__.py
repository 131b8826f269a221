"""The shapes of objects: one file for each family, one short function for each shape.

A shape is a function from an :class:`~er_gym.sim.render.appearance.Appearance` to a
:class:`~er_gym.sim.render.mesh.Mesh` of the appearance's size. It is registered for one or several
object types in the table :data:`SHAPES`.
"""

from er_gym.sim.render.shapes import (  # noqa: F401  (each registers its shapes)
    appliances,
    bathroom,
    bedding,
    cleaning,
    cutlery,
    decor,
    doors,
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
from er_gym.sim.render.shapes.registry import (
    SHAPES,
    UNSEEN,
    build,
    is_added,
    load_added,
    without_shape,
)

__all__ = ["SHAPES", "UNSEEN", "build", "is_added", "without_shape"]

load_added()
