"""Benchmarks: play (agent x tasks), keep every episode, score and report.

Nothing is imported here, so that ``er-gym --help`` stays instant. The parts, from the bottom up:
:mod:`~benchmarks.episode` (what is kept of an episode), :mod:`~benchmarks.metrics` (what it is
worth), :mod:`~benchmarks.play` (one episode), :mod:`~benchmarks.pool` and
:mod:`~benchmarks.runner` (many, in worker processes), :mod:`~benchmarks.engines` and
:mod:`~benchmarks.together` (many at once of agents that wait, engines in worker processes),
:mod:`~benchmarks.store` (the run directory), :mod:`~benchmarks.report` (tables),
:mod:`~benchmarks.cli` (the command ``er-gym``).
"""
