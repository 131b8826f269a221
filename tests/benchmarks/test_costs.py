"""What a step costs is measured by rooms, and counted by valgrind."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from benchmarks.perf import costs


def test_rooms_with_few_and_with_many_objects_are_played() -> None:
    first, last = costs.by_objects(2, 5)
    assert first["objects"] < last["objects"] - 20
    assert min(first["seconds"], last["seconds"]) > 0


def test_the_difference_of_two_runs_is_counted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    program = tmp_path / "valgrind"
    program.write_text(
        "#!/bin/sh\nfor last; do :; done\n"
        'case "$*" in *MiniGrid*) each=10;; *) each=30;; esac\n'
        'echo "==1== I refs:        $((7000000 + each * last))" | sed "s/000$/,000/" >&2\n'
    )
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    result = CliRunner().invoke(costs.main, ["--instructions"])
    assert result.exit_code == 0, result.output
    assert [line.split()[-1] for line in result.output.splitlines()[-2:]] == ["30", "10"]
    program.write_text("#!/bin/sh\necho broken >&2\nexit 1\n")
    result = CliRunner().invoke(costs.main, ["--instructions"])
    assert result.exit_code == 1
    assert "valgrind failed: broken" in result.output


def test_an_environment_is_played(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("ER-SingleSearch-v0", costs.MINIGRID):
        costs.play(name, 3)
