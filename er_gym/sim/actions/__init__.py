"""AI2-THOR's actions, one small file a family. Importing this package registers them all."""

from er_gym.sim.actions import (  # noqa: F401  (imported for their registrations)
    accepted,
    arrange,
    cameras,
    look,
    move,
    open_toggle,
    paths,
    pick_place,
    presence,
    push,
    put_at,
    query,
    setup,
    state_change,
)
from er_gym.sim.actions.registry import ACTIONS, perform

__all__ = ["ACTIONS", "perform"]
