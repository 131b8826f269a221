"""A shape and an AI2-THOR action of another package: docs/extending.md."""

from er_gym.sim.actions.checks import require, target
from er_gym.sim.actions.registry import action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.world import World


@shape("LavaLamp")
def lava_lamp(appearance: Appearance) -> Mesh:
    """A cone of glass on a foot, red where it is on."""
    width, height, depth = appearance.size
    mesh = Mesh()
    mesh.box((0.0, 0.1 * height, 0.0), (width, 0.2 * height, depth), (0.2, 0.2, 0.2))
    colour = (1.0, 0.1, 0.0) if appearance.on else (0.5, 0.1, 0.1)
    mesh.cylinder((0.0, 0.6 * height, 0.0), 0.5 * width, 0.8 * height, colour, top=0.2 * width)
    return mesh


@action("PolishObject")
def polish(world: World, *, objectId: str, shine: float = 1.0) -> float:
    """Make an object clean; the action's return is how it shines."""
    i = target(world, objectId, False)
    require(world, i, "dirtyable", "something that can be polished")
    if shine <= 0:
        raise ActionFailed(f"shine is {shine:g}; give more than 0.")
    world.set_state(i, "isDirty", False)
    return shine
