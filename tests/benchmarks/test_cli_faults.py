"""``er-gym bench --faults``."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from benchmarks.cli import main as cli

ErGym = Callable[..., tuple[Any, str, str]]


@pytest.fixture
def er_gym(capsys: pytest.CaptureFixture[str]) -> ErGym:
    """Runs the command in this process; returns exit code, stdout and stderr."""

    def run(*arguments: object) -> tuple[Any, str, str]:
        with pytest.raises(SystemExit) as left:
            cli.main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return left.value.code, out, err

    return run


def bench(*options: object) -> tuple[object, ...]:
    return ("bench", "--suite", "mini", "--agent", "searcher", "--limit", 6, *options)


def env(run: Path) -> dict[str, Any]:
    return json.loads((run / "run.json").read_text())["env"]


def records(run: Path) -> list[dict[str, Any]]:
    texts = [path.read_text() for path in sorted((run / "episodes").glob("*.json"))]
    return [{**json.loads(text), "seconds": 0, "run": ""} for text in texts]


def test_one_worker_meets_the_faults_that_two_meet(er_gym: ErGym, tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    assert er_gym(*bench("--faults", "navigate=0.5,open=0.5", "--out", one))[0] == 0
    assert er_gym(*bench("--faults", "open=0.5,navigate=.5", "--out", two, "--workers", 2))[0] == 0
    assert env(one) == env(two)
    assert env(one)["faults"] == {"navigate": 0.5, "open": 0.5}
    assert records(one) == records(two)
    said = [step["feedback"] for record in records(one) for step in record["steps"]]
    assert any("you arrived at" in feedback for feedback in said)
    code, out, _ = er_gym("report", one)
    assert code == 0
    assert "searcher" in out


def test_without_faults_a_manifest_does_not_speak_of_them(er_gym: ErGym, tmp_path: Path) -> None:
    for number, rates in enumerate(("0", "put=0")):
        out = tmp_path / str(number)
        assert er_gym(*bench("--limit", 1, "--faults", rates, "--out", out))[0] == 0
        assert "faults" not in env(out)
    # A run with faults is another run.
    code, _, err = er_gym(*bench("--limit", 1, "--faults", 0.1, "--out", out))
    assert code == 2
    assert "holds another run: its env.faults is not given, this one's 0.1" in err


@pytest.mark.parametrize("rates", ["2", "fly=0.1", "open=", "open=0.1,open=0.2", ""])
def test_bad_rates_end_in_one_line(er_gym: ErGym, tmp_path: Path, rates: str) -> None:
    code, out, err = er_gym(*bench("--faults", rates, "--out", tmp_path / "x"))
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "fault" in err
    assert not (tmp_path / "x").exists()
