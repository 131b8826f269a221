"""The solids of objects: a few boxes for each, from one table of families.

AI2-THOR records one box for each object, and most objects do not fill it. :mod:`families` says, for
each object type, which parts an object of a given size has and which of them hide what is behind.
:mod:`counter_tops` cuts bent counters to the area that the agent's body leaves free. :mod:`facing`
finds the heading of an object's front. :mod:`solid` places the parts in the world.
:mod:`sample_points` chooses the points of an object that make it visible.
"""

from er_gym.sim.space.solids.solid import Solid, solid_of

__all__ = ["Solid", "solid_of"]
