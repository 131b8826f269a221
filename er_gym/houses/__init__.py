"""Houses without end: a generator of furnished houses in ProcTHOR's JSON.

A house has a name, ``House3-17``: three rooms, seed 17. The name is enough to make it again,
anywhere, so tasks and records hold names and no houses.

:mod:`plan` divides a rectangle into rooms, :mod:`openings` gives them doors and windows,
:mod:`furniture` and :mod:`clutter` fill them, and :mod:`generate` puts a house together and tries
again until it is walkable and nothing stands inside something else. :mod:`names` knows the houses
by their names.
"""
