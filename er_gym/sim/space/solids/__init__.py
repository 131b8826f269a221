"""What things are made of: a few boxes for each, from one table of families.

The record gives one box an object; things are not boxes. :mod:`families` says, by type, which parts
a thing of a given size has, and which of them hide what is behind; :mod:`counters` cuts counters
that bend to what the agent's body leaves over; :mod:`facing` finds which way a thing's front
points; :mod:`placed` sets the parts into the world; :mod:`samples` spreads the points over a thing
that are looked for when one asks whether it is visible.
"""

from er_gym.sim.space.solids.solid import Solid, solid_of

__all__ = ["Solid", "solid_of"]
