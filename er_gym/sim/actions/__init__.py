"""AI2-THOR's actions, one small file for each family. Importing this package registers them."""

from er_gym.sim.actions import (  # noqa: F401  (imported for their registrations)
    arrange_objects,
    cameras,
    hand,
    houses,
    initialize,
    lines,
    looks,
    many,
    move,
    navigation,
    no_effect,
    object_queries,
    open_toggle,
    pick_place,
    place_at_point,
    presence,
    push,
    query,
    rotate_look,
    sight_queries,
    state_change,
)
from er_gym.sim.actions.registry import ACTIONS, load_added, perform

__all__ = ["ACTIONS", "perform"]

load_added()
