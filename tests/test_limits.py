"""Each test has a limit of its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from support import ROOT

HANGS = """
import threading
def test_that_waits():
    try:
        threading.Event().wait()
    finally:
        if TIDIES_UP_FOR_EVER:
            threading.Event().wait()
def test_after():
    pass
"""


def pytest_of(program: str, folder: Path, last: int) -> str:
    """What pytest prints of a program, with this project's settings and shorter limits."""
    (folder / "test_it.py").write_text(program, encoding="utf-8")
    limits = ("-o", "timeout=1", "-o", f"faulthandler_timeout={last}")
    command = [sys.executable, "-m", "pytest", "-n0", "-p", "no:cacheprovider", *limits]
    settings = ("-c", str(ROOT / "pyproject.toml"), "--rootdir", str(folder))
    done = subprocess.run(
        [*command, *settings, "test_it.py"], cwd=folder, capture_output=True, text=True, timeout=100
    )
    assert done.returncode == 1
    return done.stdout + done.stderr


def test_a_test_that_hangs_fails_and_the_others_go_on(tmp_path: Path) -> None:
    told = pytest_of(f"TIDIES_UP_FOR_EVER = False\n{HANGS}", tmp_path, last=60)
    assert "Timeout (>1.0s)" in told
    assert "threading.Event().wait()" in told
    assert "1 failed, 1 passed" in told


def test_a_test_that_hangs_even_then_ends_its_process(tmp_path: Path) -> None:
    told = pytest_of(f"TIDIES_UP_FOR_EVER = True\n{HANGS}", tmp_path, last=3)
    assert "most recent call first" in told
    assert "in test_that_waits" in told


def test_there_are_limits(pytestconfig: pytest.Config) -> None:
    first = float(pytestconfig.getini("timeout"))
    assert 60 <= first < float(pytestconfig.getini("faulthandler_timeout"))
    assert pytestconfig.getini("faulthandler_exit_on_timeout")
