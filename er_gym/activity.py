"""Tells whoever listens what takes long: a phase that begins, packages that are imported.

Telling is logging at the level INFO to :data:`LOG`. The command ``er-gym`` shows it; a program may
add a handler of its own. Nobody hears it otherwise.
"""

from __future__ import annotations

import logging
import sys

LOG = logging.getLogger("er_gym.activity")
IMPORTS = "imports"
"""The attribute of a log record that is True where packages are imported."""


def begin(what: str) -> None:
    """Tell what begins, such as ``starting 4 workers``; "" if something else is shown now."""
    LOG.info("%s", what, extra={IMPORTS: False})


def begin_import(name: str, *modules: str) -> None:
    """Tell that packages are imported now, unless they are there already.

    Args:
        name: of the packages, in words.
        modules: their names.
    """
    if not all(module in sys.modules for module in modules):
        LOG.info("loading %s", name, extra={IMPORTS: True})
