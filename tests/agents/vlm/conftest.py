"""A server of the tests' own."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it

from naughty_server import NaughtyServer


@pytest.fixture
def naughty() -> Iterator[NaughtyServer]:
    """A server that behaves, until it is told otherwise with ``then``."""
    with NaughtyServer() as server:
        yield server
