"""The same tasks with one thing changed: how they are played, kept and compared."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.harness import played as played_module
from benchmarks.harness.played import played
from benchmarks.pages import sensitivity
from benchmarks.pages.sensitivity import CHANGES, SEEDS, SIZES, USUAL, chapter, from_afar
from er_gym.envs.skills import Reachable, start_pose
from er_gym.tasks.suites import own_tasks
from er_gym.tasks.wordings.instructions import wording_of

BOUNDS = {"center": {"x": 2.0, "y": 1.0, "z": 1.0}, "size": {"x": 4.0, "y": 2.0, "z": 2.0}}


class Broken:
    obs_mode = "text"

    def reset(self, *_: object) -> None:
        raise ValueError("broken")

    act = reset


def test_episodes_are_kept_and_only_the_rest_is_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tasks = [task for task in own_tasks("mini") if task.type.name == "single_toggle"][:2]
    env = {"instances": "explore"}
    (one,) = played(tmp_path, "x", "searcher", tasks[:1], env=env)
    both = played(tmp_path, "x", "searcher", tasks[::-1], env=env, seed=1)
    assert [each.task_id for each in both] == [task.id for task in tasks[::-1]]
    assert one.seed != both[1].seed
    assert one.steps == both[1].steps
    with monkeypatch.context() as patched:
        patched.setattr(played_module, "play_episode", None)  # nothing is left to play
        assert played(tmp_path, "x", "searcher", tasks[::-1], env=env, seed=1) == both
    monkeypatch.setattr(played_module, "make_agent", lambda *_: Broken())
    with pytest.raises(RuntimeError, match=f"broken-one in {tasks[0].id}: "):
        played(tmp_path, "x", "broken-one", tasks[:1], env=env)


def test_the_other_start_is_far_away_and_looks_back() -> None:
    floor = Reachable([{"x": x, "y": 0.9, "z": z} for x in (0.1, 2.0, 3.5) for z in (0.2, 1.5)])
    usual, other = start_pose(BOUNDS, floor), from_afar(BOUNDS, floor)
    assert (usual.x, usual.z, usual.rotation) == (0.1, 0.2, 45)
    assert (other.x, other.y, other.z, other.rotation) == (3.5, 0.9, 1.5, 225)


def test_a_task_is_played_from_the_other_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    ways = [("oracle", way, ("single_toggle",), 1) for way in (USUAL, CHANGES["another start"])]
    monkeypatch.setattr(sensitivity, "_plan", lambda *_: ways)
    (_, (usual,)), (key, (other,)) = sensitivity.plays(tmp_path, 1, 1)
    assert key == ("oracle", "another start")
    assert usual.success
    assert usual.task_id == other.task_id
    assert usual.steps[0].navigable != other.steps[0].navigable  # it sees other things


def test_each_change_tells_the_same_task_otherwise() -> None:
    task = own_tasks("mini")[0]
    said = {name: way.told(task) for name, way in {"usual": USUAL, **CHANGES}.items()}
    assert said["another start"] == said["usual"]
    assert len({each.instruction for each in said.values()}) == 4
    kinds = {name: wording_of(task.name, each.instruction) for name, each in said.items()}
    assert {name for name, kind in kinds.items() if kind != "seen"} == {"an unseen wording"}
    assert kinds["an unseen wording"] == "unseen"
    assert all(each.key_actions is task.key_actions for each in said.values())


def test_the_chapter_has_a_row_for_each_change_and_seed(episode) -> None:  # type: ignore[no-untyped-def]
    won, lost = episode(("end",), ("end",)), episode(("end",), ("observe",))
    other = won.model_copy(update={"task_id": "b"}), lost.model_copy(update={"task_id": "b"})
    found = {(agent, way.name): [won, other[0]] for agent, way, *_ in sensitivity._plan(1, 1)}
    found["zoo:all", "another start"] = [lost, other[1]]
    found["random", "seen wording, seed 1"] = [lost, other[0]]
    rows = [line for line in chapter(found).splitlines() if line.startswith("|")]
    assert len(rows) == 2 * 2 + 4 * len(CHANGES) + 1 + len(SIZES) - 1 + len(SEEDS)
    for row in (
        "another start | zoo:all | 2 | 100.0 | 0.0 | -100.0 | -100.0 to -100.0 | 0 | 2",
        "896 × 504 pixels | zoo:er-tiny-vl | 2 | 100.0 | 100.0 | +0.0 | 0.0 to 0.0 | 0 | 0",
        "random | none | 2 | 5 | 90.0 | 50.0 to 100.0 | 22.4 | 21.2 | 34.2 to 100.0 | 1",
        "searcher | none | 2 | 2 | 100.0 | 100.0 to 100.0 | 0.0 | 0.0 | 34.2 to 100.0 | 2",
    ):
        assert f"| {row} |" in rows
