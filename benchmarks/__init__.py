"""Benchmarks: play (agent x tasks), keep every episode, score and report.

Nothing is imported here, so ``er-gym --help`` is instant. The parts:

* :mod:`benchmarks.cli`: the command ``er-gym``, one file a command.
* :mod:`benchmarks.scoring`: metrics, tables, reports, charts.
* :mod:`benchmarks.perf`: scripts that measure speed; not in the wheel.
* :mod:`benchmarks.checks`: scripts that look for faults and compare; not in the wheel.
* :mod:`benchmarks.harness`: what these scripts share; not in the wheel.
* :mod:`benchmarks.pages`: scripts that make pages of ``docs/``; not in the wheel.

:mod:`er_gym.rollout` plays the episodes.
"""
