"""Says on stderr what a command is doing while it prints nothing else.

On a terminal that is one line with the seconds since it began, which goes away by itself. Elsewhere
only the imports that take long are told, in a line each, so that logs stay short. What lower layers
do is heard from :mod:`er_gym.activity`.
"""

from __future__ import annotations

import contextlib
import logging
import os
import sys
from collections.abc import Callable, Iterator

from benchmarks.cli.live_line import LINE
from benchmarks.terminal import echo, without_control_codes

Count = Callable[[], str]
_HEARD = "er_gym.activity"
"""As in ``er_gym.activity``, whose package is slow to import; a test compares."""


def doing(what: str, count: Count | None = None) -> None:
    """Say on a terminal what is being done, until the next call or the next result.

    Args:
        what: such as ``reading the suite``; "" to say no more.
        count: called from another thread several times a second: how far it is, in words.
    """
    if not what:
        LINE.end()
    elif _is_terminal():
        LINE.show(without_control_codes(what), count)


@contextlib.contextmanager
def showing_activity() -> Iterator[None]:
    """Within, what lower layers tell is shown; the line is gone at the end, in any case."""
    log, heard = logging.getLogger(_HEARD), _Heard()
    level, propagates = log.level, log.propagate
    log.addHandler(heard)
    log.setLevel(logging.INFO)
    log.propagate = False  # packages such as minari give the root logger a handler of their own
    try:
        yield
    finally:
        log.removeHandler(heard)
        log.setLevel(level)
        log.propagate = propagates
        LINE.end()


class _Heard(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        what = record.getMessage()
        if not getattr(record, "imports", False):
            doing(what)
        elif _is_terminal():
            doing(what, new_modules())
        else:
            echo(what, err=True)


def new_modules() -> Count:
    """Counts the modules that are imported from now on."""
    before = len(sys.modules)
    return lambda: f"{len(sys.modules) - before:,} modules"


def _is_terminal() -> bool:
    """Whether stderr is a terminal that can erase a line; of several processes, one draws."""
    stream, told = sys.stderr, os.environ
    able = told.get("TERM", "") not in ("", "dumb") and told.get("LOCAL_RANK", "0") == "0"
    return able and stream is not None and stream.isatty()
