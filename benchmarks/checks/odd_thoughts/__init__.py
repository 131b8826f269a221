"""Searches the thoughts of a collection for guesses at what had been seen, and for odd thoughts.

    python -m benchmarks.checks.odd_thoughts DIR … [--show 3] [--json FILE]

It reads collections of either language and counts, by part, the trajectories that have each kind of
oddity, and how many episodes end with one of the six most frequent closers. The records decide what
was seen, done and asked; the words are those of the grounded writer.
"""
