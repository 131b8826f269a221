"""The command er-gym, run in this process."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from benchmarks.cli import main as cli


@pytest.fixture
def er_gym(capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[int, str, str]]:
    """Runs the command; returns exit code, stdout and stderr."""

    def run(*arguments: object) -> tuple[int, str, str]:
        with pytest.raises(SystemExit) as left:
            cli.main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return left.value.code, out, err

    return run
