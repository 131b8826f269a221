"""A plugin of pytest that notes which test runs which lines of a package, and how long it takes.

    ER_GYM_WATCHED=folder python -m pytest -p benchmarks.checks.planting.watching

The folder holds coverage's configuration, ``coverage.ini``; the lines come into the file that it
names, the seconds by test, in the order in which they ran, into ``seconds.json``. (pytest-cov's own
contexts stay empty in a checkout with these settings.)
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

_FOLDER = Path(os.environ["ER_GYM_WATCHED"])
_WATCH = coverage.Coverage(config_file=str(_FOLDER / "coverage.ini"))
_WATCH.start()  # before the tests and what they test are imported
_SECONDS: defaultdict[str, float] = defaultdict(float)


def _in_context(item: pytest.Item, phase: str) -> Iterator[None]:
    _WATCH.switch_context(f"{item.nodeid}|{phase}")
    yield
    _WATCH.switch_context("")


@pytest.hookimpl(hookwrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """Lines of fixtures, which other tests may share."""
    yield from _in_context(item, "setup")


@pytest.hookimpl(hookwrapper=True, tryfirst=True)
def pytest_runtest_call(item: pytest.Item) -> Iterator[None]:
    """Lines that the test itself runs."""
    yield from _in_context(item, "run")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up the seconds of a test's phases."""
    _SECONDS[report.nodeid] += report.duration


def pytest_unconfigure() -> None:
    """Write everything, with the lines of the processes that tests started."""
    _WATCH.stop()
    _WATCH.save()
    every = coverage.Coverage(config_file=str(_FOLDER / "coverage.ini"))
    every.load()
    every.combine()
    every.save()
    (_FOLDER / "seconds.json").write_text(json.dumps(_SECONDS), encoding="utf-8")
