"""``er-gym ui`` opens a browser where there is a screen for one, and says nothing of its own."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import pytest

from benchmarks.cli import ui

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has xdg-open")
CALLED = """#!/bin/sh
echo "xdg-open: no method available for opening '$1'"
echo "xdg-open: error" >&2
echo "$1" > {note}.draft && mv {note}.draft {note}
exit 3
"""


@pytest.fixture
def note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """What an xdg-open that finds no browser was called with; it says so on both outputs."""
    program, note = tmp_path / "xdg-open", tmp_path / "note"
    program.write_text(CALLED.format(note=note))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    for name in ui._SCREENS:
        monkeypatch.delenv(name, raising=False)
    return note


def test_what_the_opener_prints_is_not_shown(note, monkeypatch, capfd) -> None:
    monkeypatch.setenv("DISPLAY", ":99")
    ui._open_browser("http://127.0.0.1:1/")
    for _ in range(600):
        if note.exists():
            break
        time.sleep(0.1)
    assert note.read_text() == "http://127.0.0.1:1/\n"
    assert capfd.readouterr() == ("", "")


def test_nothing_is_opened_without_a_screen(note, monkeypatch, capfd) -> None:
    monkeypatch.setattr(ui.subprocess, "Popen", lambda *_, **__: pytest.fail("was opened"))
    ui._open_browser("http://127.0.0.1:1/")
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setenv("PATH", "/nowhere")
    ui._open_browser("http://127.0.0.1:1/")
    assert capfd.readouterr() == ("", "")
