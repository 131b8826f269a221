"""``er-gym bench --fresh``: tasks that nobody can have seen, made once and played."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.cli.main import main
from er_gym.tasks import suites
from er_gym.tasks.suites import SuiteConfig, load_suite, suite_from_file

TINY = SuiteConfig.model_validate(
    {
        "description": "a few tasks in one room",
        "tasks": "tiny.jsonl.gz",
        "env": {"grid_size": 0.25},
        "generate": {
            "scenes": ["FloorPlan5"],
            "types": ["single_search", "single_pickup"],
            "total": 4,
            "layouts": 1,
        },
    }
)


@pytest.fixture(autouse=True)
def _tiny_suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A small suite, in a folder of the test's own."""
    own = suites.suite_config
    monkeypatch.setattr(suites, "suite_config", lambda name: TINY if name == "tiny" else own(name))
    monkeypatch.setenv("ER_GYM_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)


def bench(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["bench", "--agent", "oracle", *arguments])
    return int(ended.value.code or 0)


def test_tasks_are_made_once_and_played(tmp_path: Path) -> None:
    assert bench("--suite", "tiny", "--fresh", "5", "--out", "one") == 0
    file = tmp_path / "home" / "suites" / "tiny-fresh-5.jsonl.gz"
    made, when = suite_from_file(file), file.stat().st_mtime_ns
    assert {task.scene for task in made.tasks} == {"FloorPlan5"}
    assert len(made.tasks) == 4
    run = json.loads((tmp_path / "one" / "run.json").read_text())
    assert (run["suite"], run["suite_digest"]) == ("tiny-fresh-5", made.digest)
    assert run["env"]["grid_size"] == 0.25  # the suite's
    assert len(list((tmp_path / "one" / "episodes").glob("*.json"))) == 4
    assert bench("--suite", "tiny", "--fresh", "5", "--out", "one") == 0
    assert file.stat().st_mtime_ns == when


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--fresh", "5"], "--fresh needs --suite"),
        (["--suite", "tiny", "--fresh", "0"], "tiny itself has this seed; give another one"),
        (["--suite", "big", "--fresh", "5"], "'big'"),
        (["--suite", "tiny", "--fresh", "-1"], "--fresh"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert bench(*arguments) == 2
    told = capsys.readouterr().err
    assert said in told
    assert told.count("\n") == 1


def test_the_validation_suite_shares_no_arrangement() -> None:
    def places(name: str) -> set[tuple[object, ...]]:
        return {
            (
                task.scene,
                *sorted((key, pose.x, pose.z) for key, pose in task.arrangement.poses.items()),
            )
            for task in load_suite(name).tasks
        }

    own = places("er-val")
    assert len(own) > 100
    assert all(len(place) > 1 for place in own)  # none as recorded
    assert own.isdisjoint(places("er-1k") | places("train"))
    assert "FloorPlan7" not in {scene for scene, *_ in own}
