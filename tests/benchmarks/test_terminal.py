"""The command prints every text literally, without control codes."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from benchmarks import terminal as terminal_module
from benchmarks.checks import terminals
from benchmarks.checks.bad_files import HOSTILE
from benchmarks.cli import main as cli
from benchmarks.cli.progress import Progress
from benchmarks.scoring.tables import print_tables
from benchmarks.terminal import terminal, without_control_codes
from er_gym.tables import Table


def test_terminal_control_characters_are_shown_as_escapes():
    assert (
        without_control_codes("a\x1b[31m\x07\x9b\u202e\ud800\r")
        == r"a\x1b[31m\x07\x9b\u202e\ud800\r"
    )
    assert without_control_codes("kept: ä 中 😀\t\n") == "kept: ä 中 😀\t\n"


@pytest.mark.parametrize("name", ["openai:x:", "[red]x[/]", "[/]", ":smile:", HOSTILE])
def test_names_stand_in_tables_and_lines_as_they_are(name):
    console = terminal(width=200)
    console.file = io.StringIO()
    print_tables([Table(name, ("Agent",), ((name,),), 1, notes=(name,))], console)
    with Progress(console, name, 1) as progress:
        progress.episode(True)
        progress.say(name)
    said = console.file.getvalue()
    shown = without_control_codes(name.replace("\x07", ""))  # Rich leaves it out of all but cells
    assert said.count(shown) + said.count(without_control_codes(name)) >= 5
    assert "\x1b" not in said


def test_errors_are_one_line_that_no_terminal_obeys(capsys):
    with pytest.raises(SystemExit) as left:
        cli.main(["render", "--scene", f"{HOSTILE}{'x' * 9000}"])
    err = capsys.readouterr().err
    assert left.value.code == 2
    assert err.count("\n") == 1
    assert "\x1b" not in err
    assert len(err) < 2_200


def test_the_command_prints_through_one_function_alone():
    files = set(Path(cli.__file__).parent.glob("*.py")) - {Path(terminal_module.__file__)}
    assert len(files) > 15
    for file in files:
        text = file.read_text()
        assert "click.echo" not in text, file
        assert "Console(" not in text, file


def test_light_commands_work_with_and_without_a_terminal_anywhere(capsys):
    tally = terminals.check(["envs"], checkout=False)
    tally += terminals.check(["report OUT/none"], checkout=False)
    assert tally.tried == 4
    assert tally.failed == 0, capsys.readouterr().out


def test_what_a_terminal_check_notices(tmp_path, monkeypatch, capsys):
    """Programs that do what it looks for."""
    wrong = {
        "ends wrongly": "raise SystemExit(3)",
        "a traceback": "import sys; sys.stderr.write('Traceback (most recent call last)')",
        "a control code": "print('\\x1b[1m')",
        "no JSON": "print('{')",
        "no file": "",
    }
    for what, program in wrong.items():
        line = terminals.Line("", makes="out" if what == "no file" else "", json=what == "no JSON")
        monkeypatch.setattr(terminals, "LINES", (line,))
        command = [sys.executable, "-c", program]
        assert terminals.check(command=command, checkout=False).failed, what
