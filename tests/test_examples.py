"""The examples run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


def test_the_ai2thor_tutorial_runs_on_our_engine(
    repository: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))  # where the client keeps its logs
    script = repository / "examples" / "ai2thor_tutorial.py"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "FloorPlan1_physics: 77 objects" in done.stdout
    assert "the apple is in ['Fridge|-02.10|+00.00|+01.07'], cold" in done.stdout
