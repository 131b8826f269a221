"""What a command says that it is doing, on a terminal and elsewhere."""

from __future__ import annotations

import io
import os
import subprocess
import sys

import pytest
from support import ROOT

from benchmarks.cli import activity, live_line
from benchmarks.cli.activity import doing, showing_activity
from benchmarks.cli.live_line import Line
from benchmarks.cli.progress import bar
from benchmarks.harness.processes import run
from benchmarks.terminal import echo, terminal
from er_gym.activity import LOG, begin, begin_import

ER_GYM = (sys.executable, "-m", "benchmarks.cli")


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self) -> bool:
        return True

    @property
    def shown(self) -> list[str]:
        """What was written, apart at what erases a line."""
        return self.getvalue().split(live_line._ERASE)


@pytest.fixture
def on_screen(monkeypatch):
    """Called in a test, it puts a terminal behind both streams, on which ``draw`` alone draws."""

    def start() -> Screen:
        shown = Screen()
        monkeypatch.setattr(sys, "stdout", shown)
        monkeypatch.setattr(sys, "stderr", shown)
        return shown

    monkeypatch.setattr(live_line, "_DELAY", 3600.0)
    monkeypatch.setenv("TERM", "xterm")
    yield start
    live_line.LINE.end()


def draw() -> None:
    live_line.LINE._draw()


def test_a_message_takes_the_lines_place_and_a_result_ends_it(on_screen):
    screen = on_screen()
    doing("reading", lambda: "3 of 7")
    draw()
    print("a library's warning", file=sys.stderr)
    draw()
    doing("writing\x1b[31m")
    draw()
    draw()  # unchanged: nothing is written
    echo("the result")
    assert screen.shown == [
        "",
        "reading (3 of 7)",
        "a library's warning\n",
        "reading (3 of 7)",
        r"writing\x1b[31m ...",
        "the result\n",
    ]
    assert sys.stdout is screen
    assert sys.stderr is screen


def test_print_ends_the_line_too(on_screen):
    screen = on_screen()
    for number in range(20):  # Python's print() would use a stream that is gone
        doing("reading")
        draw()
        print("result", number)
    assert screen.shown[1:] == [
        text for number in range(20) for text in ("reading ...", f"result {number}\n")
    ]


def test_a_long_line_is_cut_and_the_seconds_are_counted(on_screen, monkeypatch):
    screen = on_screen()
    monkeypatch.setattr(live_line, "_columns", lambda stream: 20)
    doing("x" * 50)
    live_line.LINE._since -= 5
    draw()
    assert screen.shown[1] == f"{'x' * 16}..."
    doing("going on")
    live_line.LINE._since -= 5.5
    draw()
    assert screen.shown[2] == "going on (5 s)"


def test_a_bar_has_the_place_alone(on_screen):
    screen = on_screen()
    console = terminal(stderr=True)
    doing("before")
    with bar(console):
        doing("meanwhile")
        assert live_line.LINE._ended is None
    assert live_line.LINE._what == "finishing"
    doing("")
    assert live_line.LINE._ended is None
    assert "meanwhile" not in screen.getvalue()


def test_what_lower_layers_tell_is_shown_while_a_command_runs(on_screen):
    screen = on_screen()
    assert LOG.name == activity._HEARD
    begin("unheard")
    with showing_activity():
        begin("starting 2 workers")
        draw()
        begin_import("a package", "no_such_package")
        draw()
        begin_import("json", "json")  # there already
    begin("unheard")
    assert screen.shown == ["", "starting 2 workers ...", "loading a package (0 modules)", ""]
    assert not LOG.handlers


@pytest.mark.parametrize("term", ["xterm", "dumb"])
def test_without_a_terminal_only_imports_are_told(term, capsys, monkeypatch):
    monkeypatch.setenv("TERM", term)
    if term == "dumb":
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    with showing_activity():
        doing("reading")
        begin("starting")
        begin_import("PyTorch", "no_such_package")
    assert capsys.readouterr() == ("", "loading PyTorch\n")


def test_what_is_told_is_not_logged_again_by_a_package_that_configures_logging(caplog):
    """As minari does when it is imported; pytest's own handler is one of the root logger."""
    with showing_activity():
        begin("starting")
    assert caplog.records == []
    assert LOG.propagate


def test_of_several_processes_of_a_training_one_draws(on_screen, monkeypatch):
    on_screen()
    monkeypatch.setenv("LOCAL_RANK", "1")
    doing("training")
    assert live_line.LINE._ended is None


def test_a_terminal_that_has_gone_ends_nothing(monkeypatch):
    class Gone(Screen):
        def write(self, text):
            raise OSError(5, "Input/output error")

    line, gone = Line(), Gone()
    monkeypatch.setattr(sys, "stderr", gone)
    line._stream, line._drawn = gone, "reading"
    line._erase()
    line.end()


def test_a_command_says_what_it_does_before_it_is_loaded(tmp_path):
    """In a real terminal: the line comes first, nothing of it stays; JSON is as without one."""
    shown = run([*ER_GYM, "zoo", "show", "all"], cwd=tmp_path)
    assert shown.code == 0
    assert shown.said[0].shown.startswith("zoo:loadinger-gym(")
    last_line = shown.text().replace("\r", "\n").split("modules)")[-1]
    plain = run([*ER_GYM, "zoo", "show", "all"], cwd=tmp_path, terminal=False)
    assert plain.text("err") == ""
    assert "loading" not in plain.text("out")
    assert "".join(last_line.split())[-200:] == "".join(plain.text("out").split())[-200:]


def test_ctrl_c_leaves_one_line(tmp_path):
    done = run([*ER_GYM, "suites"], cwd=tmp_path, until="loading er-gym")
    assert done.code == 130
    assert done.text().rstrip().endswith("er-gym: interrupted")
    assert "Traceback" not in done.text()


INTERRUPTED = """
from benchmarks.cli.main import cli, main
cli.commands["suites"].callback = lambda: exec("raise KeyboardInterrupt")
main(["suites"])
"""


def test_ctrl_c_ends_with_its_exit_code_also_while_a_dataclass_is_made(tmp_path):
    (tmp_path / "stopped.py").write_text(INTERRUPTED, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}"}
    command = [sys.executable, "-m", "stopped"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (ended.returncode, ended.stderr.strip()) == (130, "er-gym: interrupted")


@pytest.mark.parametrize("terminal", [True, False])
def test_make_shows_what_its_quiet_commands_do(tmp_path, terminal):
    (tmp_path / "lib" / "python3.12" / "site-packages" / "one-1.0.dist-info").mkdir(parents=True)
    shown = [sys.executable, "-m", "benchmarks.checks.shown", "Installing", str(tmp_path)]
    well = run([*shown, "sh", "-c", "echo said"], cwd=ROOT, terminal=terminal)
    assert well.code == 0
    assert "said\n" in well.text("out" if terminal else "err")
    assert ("Installing: 1 packages, " in well.text()) == terminal
    assert run([*shown, "sh", "-c", "exit 3"], cwd=ROOT, terminal=terminal).code == 3
