"""The boundary: makes AI2-THOR 5 controllers on either engine, for all layers above."""

from er_gym.sim.placement_restrictions import accepts, placement_table
from er_gym.sim.scene import SCENE_NAMES, UnknownSceneError
from er_gym.sim.size import check_size
from er_gym.sim.space.compiled_sight import kernel as compiled_kernel
from er_gym.thor.backends import BACKENDS, LIGHTS, RENDER_DEVICES, BackendError, make_controller
from er_gym.thor.launcher import thor_executable
from er_gym.thor.object_types import OBJECT_TYPES, ObjectType
from er_gym.thor.objects import ObjectTable, objects_of

__all__ = [
    "BACKENDS",
    "LIGHTS",
    "OBJECT_TYPES",
    "RENDER_DEVICES",
    "SCENE_NAMES",
    "BackendError",
    "ObjectTable",
    "ObjectType",
    "UnknownSceneError",
    "accepts",
    "check_size",
    "compiled_kernel",
    "make_controller",
    "objects_of",
    "placement_table",
    "thor_executable",
]
