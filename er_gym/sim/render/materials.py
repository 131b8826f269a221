"""Materials by name: their texture, and how light affects them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """A material.

    Attributes:
        texture: a name of :data:`er_gym.sim.render.textures.TEXTURES`, None for none.
        glows: whether it is drawn without shading, as screens, lamps and windows are.
        glass: whether it is transparent; it hides nothing and belongs to no instance.
        veil: whether it is a shadow: glass that is as dark as the alpha of its colours.
    """

    texture: str | None = None
    glows: bool = False
    glass: bool = False
    veil: bool = False


MATERIALS: dict[str, Material] = {
    "plain": Material(),
    "glowing": Material(glows=True),
    "glass": Material(glass=True),
    **{
        name: Material(name)
        for name in (
            "wood", "planks", "tiles", "wall_tiles", "plaster", "fabric", "stripes", "carpet",
            "stone", "metal", "leaves", "cardboard", "paper", "newspaper", "book", "keys", "label",
            "basketball", "bread", "crust", "wicker", "marble", "bark", "clock", "card", "disc",
        )
    },
    **{
        name: Material(name, glows=True)
        for name in ("sky", "screen", "desktop", "phone", "mirror", "flame", "digits")
    },
    **{f"picture{k}": Material(f"picture{k}") for k in range(8)},
    "veil": Material(glass=True, veil=True),
}  # fmt: skip
"""The materials by name; ``picture0`` to ``picture7`` are paintings and posters."""
