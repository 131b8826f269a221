"""Recordings of the real simulator, if the shared data is available."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture(scope="session")
def captures(shared_data: Path) -> dict[str, Any]:
    """Scene to what AI2-THOR 5 said of its start pose, 40 scenes."""
    found: dict[str, Any] = json.loads((shared_data / "unity_captures_dev.json").read_text())
    return found
