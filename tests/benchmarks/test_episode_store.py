from __future__ import annotations

import json
import os

import pytest
from pydantic import ValidationError

import benchmarks.store
from benchmarks.episode import EpisodeRecord
from benchmarks.store import RunDirectoryError, RunStore, file_stem

GOLDEN = """
{"format": "er-gym/episode/1", "task_id": "t", "task_type": "single_search", "scene": "FloorPlan1",
 "instruction": "Find it.", "name": "Look for the Mug.",
 "key_actions": [{"verb": "end", "object_id": "", "object_type": "", "reward": 1.0,
                  "exact": false, "spelled": ""}],
 "max_steps": 22, "agent": "random", "seed": 3,
 "steps": [{"verb": "init", "object_type": "", "object_id": "", "success": true, "feedback": "",
            "navigable": ["Bed"], "interactable": [], "reward": 0.0, "thought": "", "text": "",
            "appended": false},
           {"verb": "error", "object_type": "", "object_id": "", "success": false,
            "feedback": "no such action", "navigable": ["Bed"], "interactable": [],
            "reward": -0.5, "thought": "hm", "text": "dance", "appended": false}],
 "success": false, "goal_unmet": ["Mug is held"], "search_targets": ["Mug"],
 "end_reason": "no known action", "total_reward": -0.5, "seconds": 1.25,
 "error": ""}
"""


def test_the_wire_format_of_an_episode():
    """Whoever changes this changes the format's name, too: results are kept for years."""
    read = EpisodeRecord.model_validate_json(GOLDEN)
    assert read.model_dump(mode="json") == json.loads(GOLDEN)
    assert read.num_steps == 1
    assert read.predicted == []


@pytest.mark.parametrize(
    "change", [{"format": "er-gym/episode/2"}, {"unheard_of": 1}, {"max_steps": 0}]
)
def test_other_formats_are_not_misread(change):
    with pytest.raises(ValidationError):
        EpisodeRecord.model_validate({**json.loads(GOLDEN), **change})


def test_what_was_written_before_goals_and_search_targets_is_read_still() -> None:
    old = json.loads(GOLDEN)
    del old["goal_unmet"], old["search_targets"], old["key_actions"][0]["exact"]
    read = EpisodeRecord.model_validate(old)
    assert (read.goal_unmet, read.search_targets) == ([], None)
    assert not read.key_actions[0].exact


def test_write_and_read(store, episode):
    first, second = episode(("end",), ("end",)), episode(("end",), (), task_id="task-2")
    for each in (second, first):
        store.write(each)
    again = RunStore.open(store.path)
    assert again.manifest == store.manifest
    assert list(again.episodes()) == [first, second]


def test_writing_again_replaces(store, episode):
    store.write(episode(("end",), (), error="ValueError: no"))
    store.write(episode(("end",), ("end",)))
    assert [each.error for each in store.episodes()] == [""]


def test_leftovers_are_passed_over(store, episode):
    path = store.write(episode(("end",), ("end",)))
    whole = path.read_text()
    (path.parent / ".task-2.abc.tmp").write_text(whole)
    (path.parent / "task-3.json").write_text(whole[: len(whole) // 2])
    (path.parent / "task-4.json").write_bytes(b"\xff\xfe\x00")
    (path.parent / "task-5.json").touch()
    assert [each.task_id for each in store.episodes()] == ["task-1"]


def test_a_write_that_fails_leaves_the_old_file(store, episode, monkeypatch):
    path = store.write(episode(("end",), ("end",)))
    before = path.read_bytes()

    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(benchmarks.store.os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        store.write(episode(("end",), ()))
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_results_can_be_read_by_others(store, episode):
    assert store.write(episode(("end",), ("end",))).stat().st_mode & 0o044 == 0o044


def test_the_same_run_continues(store, manifest):
    assert RunStore.create(store.path, manifest).manifest == manifest


def test_tuples_do_not_make_another_run(tmp_path, manifest):
    with_tuple = manifest.model_copy(update={"env": {"size": (1, 2)}})
    RunStore.create(tmp_path / "x", with_tuple)
    RunStore.create(tmp_path / "x", with_tuple)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("suite", "other"),
        ("suite_digest", "def"),
        ("agent", "random"),
        ("env", {"backend": "unity", "obs_mode": "text"}),
        ("seed", 1),
        ("er_gym", "0.2.0"),
    ],
)
def test_another_run_is_refused_by_the_field_that_differs(store, manifest, field, value):
    before = (store.path / "run.json").read_bytes()
    with pytest.raises(RunDirectoryError, match=rf"its {field} is .*another --out") as caught:
        RunStore.create(store.path, manifest.model_copy(update={field: value}))
    assert repr(value) in str(caught.value)
    assert (store.path / "run.json").read_bytes() == before


def test_episodes_of_unknown_origin_are_refused(store, manifest, episode):
    store.write(episode(("end",), ("end",)))
    (store.path / "run.json").unlink()
    with pytest.raises(RunDirectoryError, match=r"holds episodes but no run\.json"):
        RunStore.create(store.path, manifest)


def test_what_is_no_run(tmp_path, store):
    with pytest.raises(RunDirectoryError, match="is no run directory"):
        RunStore.open(tmp_path / "nowhere")
    (store.path / "run.json").write_text('{"format": "er-gym/run/1"}')
    with pytest.raises(RunDirectoryError, match="is no run manifest: suite: Field required"):
        RunStore.open(store.path)
    (store.path / "run.json").write_text("{")
    with pytest.raises(RunDirectoryError, match="is no run manifest: the file: Invalid JSON"):
        RunStore.open(store.path)


def test_fit_ids_are_their_own_file_names():
    assert file_stem("mini-single_search-FloorPlan1.3") == "mini-single_search-FloorPlan1.3"


@pytest.mark.parametrize("task_id", ["a/b", "../../etc", "..", ".hidden", "long-range tasks", "ü"])
def test_other_ids_are_made_fit(task_id):
    stem = file_stem(task_id)
    assert not stem.startswith(".")
    assert not set(stem) & set("/ \\:")
    assert stem.isascii()


def test_file_names_stay_apart_and_short():
    ids = ["a/b", "a_b", "a b", "x" * 400, "x" * 401, "..", "."]
    assert len({file_stem(each) for each in ids}) == len(ids)
    assert max(len(file_stem(each)) for each in ids) < 140
