"""Benchmarks: play (agent x tasks), keep every episode, score and report.

Nothing is imported here, so that ``er-gym --help`` stays instant. The parts, from the bottom up:
:mod:`~er_gym.rollout.records` (what is kept of an episode), :mod:`~benchmarks.scoring.metrics` (what it is
worth), :mod:`~er_gym.rollout.play` (one episode), :mod:`~er_gym.rollout.worker_pool` and
:mod:`~er_gym.rollout.runner` (many, in worker processes), :mod:`~er_gym.rollout.env_pool` and
:mod:`~er_gym.rollout.thread_executor` (many at once of agents that wait, engines in worker processes),
:mod:`~er_gym.rollout.run_directory` (the run directory), :mod:`~benchmarks.scoring.report` (tables),
:mod:`~benchmarks.cli` (the command ``er-gym``).
"""
