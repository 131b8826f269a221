"""The table of shapes by object type.

Other packages add shapes (``docs/extending.md``): functions under :func:`shape`, which are named in
the environment variable ``ER_GYM_PLUGINS`` or by entry points in the group ``er_gym.shapes``.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from er_gym.plugins import PluginError, added_objects
from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.patch import Patch

Shape = Callable[[Appearance], Mesh]
SHAPES: dict[str, Shape] = {}
"""The shape of each object type."""
UNSEEN = frozenset({"Floor", "Wall"})
"""Types that are drawn with the room and not as objects."""
_KEPT = 256
_OWN = __name__.rpartition(".")[0]


def shape(*kinds: str) -> Callable[[Shape], Shape]:
    """Register a function as the shape of some object types.

    Raises:
        ValueError: an object type has another shape already.
    """

    def register(function: Shape) -> Shape:
        for kind in kinds:
            if kind in SHAPES:
                raise ValueError(f"object type {kind!r} has a shape already; choose another name")
            SHAPES[kind] = function
        return function

    return register


def load_added() -> None:
    """Import the shapes of other packages, which registers them.

    Raises:
        PluginError: a shape cannot be loaded, or is not a registered function.
    """
    expected = f"a function under @{__name__}.shape"
    for found, origin in added_objects("shape", "shapes", expected, registers=True):
        if not any(each is found for each in SHAPES.values()):
            raise PluginError(f"{origin} is {found!r}; give {expected}")


@lru_cache(maxsize=_KEPT)
def build(appearance: Appearance) -> dict[str, Patch]:
    """The triangles of an object by material; a type without a shape is drawn as a plain box."""
    function = SHAPES.get(appearance.kind, _plain_box)
    return function(appearance).patches()


def is_added(kind: str) -> bool:
    """Whether the shape of an object type is not er-gym's own."""
    return not SHAPES.get(kind, _plain_box).__module__.startswith(_OWN)


def _plain_box(appearance: Appearance) -> Mesh:
    mesh = Mesh()
    mesh.box(
        (0.0, appearance.size[1] / 2, 0.0),
        appearance.size,
        appearance.pick(appearance.palette.accent),
    )
    return mesh


def without_shape(kinds: list[str]) -> list[str]:
    """The object types of a list that have no shape."""
    return [kind for kind in kinds if kind not in SHAPES and kind not in UNSEEN]
