from __future__ import annotations

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from pydantic import ValidationError

from er_gym.locking import Locked
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.rollout.run_directory import (
    REPLIES,
    RunDirectory,
    RunDirectoryError,
)
from er_gym.writing import file_stem

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
 "error": "", "run": ""}
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
    del old["goal_unmet"], old["search_targets"], old["run"], old["key_actions"][0]["exact"]
    read = EpisodeRecord.model_validate(old)
    assert (read.goal_unmet, read.search_targets) == ([], None)
    assert not read.key_actions[0].exact


def test_write_and_read(run_directory, episode):
    first, second = episode(("end",), ("end",)), episode(("end",), (), task_id="task-2")
    for each in (second, first):
        run_directory.write(each)
    again = RunDirectory.open(run_directory.path)
    assert again.manifest == run_directory.manifest
    assert list(again.episodes()) == [first, second]


def test_writing_again_replaces(run_directory, episode):
    run_directory.write(episode(("end",), (), error="ValueError: no"))
    run_directory.write(episode(("end",), ("end",)))
    assert [each.error for each in run_directory.episodes()] == [""]


def test_leftovers_are_passed_over(run_directory, episode):
    path = run_directory.write(episode(("end",), ("end",)))
    whole = path.read_text()
    (path.parent / ".task-2.abc.tmp").write_text(whole)
    (path.parent / "task-3.json").write_text(whole[: len(whole) // 2])
    (path.parent / "task-4.json").write_bytes(b"\xff\xfe\x00")
    (path.parent / "task-5.json").touch()
    assert [each.task_id for each in run_directory.episodes()] == ["task-1"]


def test_a_write_that_fails_leaves_the_old_file(run_directory, episode, monkeypatch):
    path = run_directory.write(episode(("end",), ("end",)))
    before = path.read_bytes()

    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        run_directory.write(episode(("end",), ()))
    assert path.read_bytes() == before
    assert os.listdir(path.parent) == [path.name]


def test_results_can_be_read_by_others(run_directory, episode):
    assert run_directory.write(episode(("end",), ("end",))).stat().st_mode & 0o044 == 0o044


def test_the_same_run_continues(run_directory, manifest):
    assert RunDirectory.create(run_directory.path, manifest).manifest == manifest


def test_tuples_do_not_make_another_run(tmp_path, manifest):
    with_tuple = manifest.model_copy(update={"env": {"size": (1, 2)}})
    RunDirectory.create(tmp_path / "x", with_tuple)
    RunDirectory.create(tmp_path / "x", with_tuple)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("suite", "other"),
        ("suite_digest", "def"),
        ("agent", "random"),
        ("env.backend", "unity"),
        ("seed", 1),
        ("er_gym", "0.2.0"),
    ],
)
def test_another_run_is_refused_by_the_field_that_differs(
    run_directory, manifest, episode, field, value
):
    run_directory.write(episode(("end",), ("end",)))
    before = (run_directory.path / "run.json").read_bytes()
    name, _, key = field.partition(".")
    change = {name: {**manifest.env, key: value} if key else value}
    with pytest.raises(RunDirectoryError, match=rf"its {field} is .*another --out") as caught:
        RunDirectory.create(run_directory.path, manifest.model_copy(update=change))
    assert repr(value) in str(caught.value)
    assert (run_directory.path / "run.json").read_bytes() == before


def test_episodes_of_unknown_origin_are_refused(run_directory, manifest, episode):
    run_directory.write(episode(("end",), ("end",)))
    (run_directory.path / "run.json").unlink()
    with pytest.raises(RunDirectoryError, match=r"holds episodes but no run\.json"):
        RunDirectory.create(run_directory.path, manifest)


def test_what_is_no_run(tmp_path, run_directory):
    with pytest.raises(RunDirectoryError, match=r"nowhere is no run: .*run\.json: no such file"):
        RunDirectory.open(tmp_path / "nowhere")
    (run_directory.path / "run.json").write_text('{"format": "er-gym/run/1"}')
    with pytest.raises(RunDirectoryError, match=r"is no run: .*run\.json: suite: Field required"):
        RunDirectory.open(run_directory.path)
    (run_directory.path / "run.json").write_text("{")
    with pytest.raises(RunDirectoryError, match=r"is no run: .*run\.json: the file: Invalid JSON"):
        RunDirectory.open(run_directory.path)


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


# -- what is none of the run's ---------------------------------------------------------------------


@pytest.fixture
def odd_files(run_directory, manifest, episode, tmp_path):
    """A run with one good episode, task-1, and files that are none; what is said of each."""
    good = run_directory.write(episode(("end",), ("end",)))
    folder, whole = good.parent, good.read_text()
    (folder / "task-1 (copy).json").write_text(whole)
    (folder / "task-2.json").write_text(whole)
    (folder / "task-3.json").write_text(whole[: len(whole) // 2])
    (folder / "task-4.json").write_bytes(b"\xff\xfe\x00")
    (folder / "task-5.json").write_text("[]")
    (folder / "task-6.json").mkdir()
    (folder / "task-7.json").write_text(whole.replace('"steps": [', '"steps": [4, '))
    other = RunDirectory.create(tmp_path / "other", manifest.model_copy(update={"seed": 1}))
    other.write(episode(("end",), (), task_id="task-8")).rename(folder / "task-8.json")
    old = episode(("end",), (), task_id="task-9").model_copy(update={"agent": "random"})
    (folder / "task-9.json").write_text(old.model_dump_json())
    (folder / "a\nb.json").touch()
    return {
        "a?b.json": "broken: the file: Invalid JSON",
        "task-1 (copy).json": "a copy: it holds the episode of 'task-1', as task-1.json",
        "task-2.json": "a copy: it holds the episode of 'task-1', as task-1.json",
        "task-3.json": "broken: the file: Invalid JSON: EOF while parsing",
        "task-4.json": "broken: the file: Invalid JSON",
        "task-5.json": "broken: the file: Input should be an object",
        "task-6.json": "not a regular file",
        "task-7.json": "broken: steps.0: Input should be an object",
        "task-8.json": "of another run: its run is ",
        "task-9.json": "of another run: its agent is 'random', not 'oracle'",
    }


def test_what_is_no_episode_of_the_run_is_named(run_directory, odd_files):
    found = run_directory.read()
    assert [each.task_id for each in found.episodes] == ["task-1"]
    said = dict(str(each).removeprefix("episodes/").split(": ", 1) for each in found.unusable)
    assert said.keys() == odd_files.keys()
    for name, words in odd_files.items():
        assert said[name].startswith(words)
        assert said[name].isprintable()


def test_it_is_moved_out_of_the_way_and_not_lost(run_directory, odd_files, episode):
    kept = {
        path.name: path.read_bytes()
        for path in (run_directory.path / "episodes").glob("task-[23]*")
    }
    told = run_directory.move_aside(["task-1", "task-2", "task-3"])
    assert len(told) == len(odd_files)
    assert sum("and the task is played anew" in line for line in told) == 2
    for name, content in kept.items():
        assert (run_directory.path / "episodes" / f"{name}.aside-1").read_bytes() == content
    run_directory.write(episode(("end",), (), task_id="task-3"))
    assert [each.task_id for each in run_directory.episodes()] == ["task-1", "task-3"]
    assert len(run_directory.move_aside(["task-1", "task-2", "task-3"])) == len(odd_files) - 2


# -- who plays has the directory -------------------------------------------------------------------


def test_a_start_that_is_refused_claims_nothing(tmp_path, manifest):
    with (
        pytest.raises(ValueError, match="no such model"),
        RunDirectory.locked(tmp_path / "a" / "x", manifest),
    ):
        raise ValueError("no such model")
    assert list(tmp_path.iterdir()) == []


def test_what_was_there_before_stays(tmp_path, run_directory, manifest, episode):
    (tmp_path / "run" / "notes.md").write_text("mine")
    with pytest.raises(KeyboardInterrupt), RunDirectory.locked(run_directory.path, manifest):
        raise KeyboardInterrupt
    assert [path.name for path in run_directory.path.iterdir()] == ["notes.md"]
    for error in ("", "ValueError: no"):
        with RunDirectory.locked(run_directory.path, manifest) as mine:
            mine.write(episode(("end",), (), error=error))
        with pytest.raises(KeyboardInterrupt), RunDirectory.locked(run_directory.path, manifest):
            raise KeyboardInterrupt
        assert len(list(RunDirectory.open(run_directory.path).episodes())) == 1


def test_a_run_killed_before_it_had_anything_gives_way(run_directory, manifest):
    other = manifest.model_copy(update={"agent": "random"})
    with RunDirectory.locked(run_directory.path, other):
        pass
    assert RunDirectory.open(run_directory.path).manifest == other


def test_what_was_paid_for_stays(run_directory, manifest):
    (run_directory.path / "spending.jsonl").write_text("{}\n")
    with (
        pytest.raises(RunDirectoryError, match="its agent is"),
        RunDirectory.locked(run_directory.path, manifest.model_copy(update={"agent": "random"})),
    ):
        pass
    with pytest.raises(KeyboardInterrupt), RunDirectory.locked(run_directory.path, manifest):
        raise KeyboardInterrupt
    assert (run_directory.path / "run.json").exists()


@pytest.mark.parametrize("name", ["spending.jsonl", "conversations/x.json", "replies/cache.db"])
def test_files_of_unknown_origin_are_refused(tmp_path, manifest, name):
    path = tmp_path / "x" / name
    path.parent.mkdir(parents=True)
    path.write_text("mine")
    with pytest.raises(RunDirectoryError, match=rf"holds {name.split('/')[0]} but no run\.json"):
        RunDirectory.create(tmp_path / "x", manifest)
    assert path.read_text() == "mine"


def test_another_kind_of_folder_is_left_alone(tmp_path, manifest):
    (tmp_path / "log.txt").write_text("of this run")
    (tmp_path / "collection.json").write_text("{}")
    with pytest.raises(RunDirectoryError, match=r"is a collection \(it holds collection\.json\)"):
        RunDirectory.create(tmp_path, manifest)
    (tmp_path / "collection.json").unlink()
    RunDirectory.create(tmp_path, manifest)


def test_two_do_not_play_in_one_directory(run_directory, manifest):
    with (
        RunDirectory.locked(run_directory.path, manifest),
        pytest.raises(Locked, match=f"in use by process {os.getpid()};"),
        RunDirectory.locked(run_directory.path, manifest),
    ):
        pass


def test_an_empty_folder_of_replies_is_nothing_to_keep(run_directory, manifest):
    """It is made before the first reply: a run killed then gives way to the corrected one."""
    file = run_directory.path / REPLIES / "cache.db"
    file.parent.mkdir()
    with closing(sqlite3.connect(file)) as database:
        database.execute("CREATE TABLE Cache (key TEXT)")
    other = manifest.model_copy(update={"agent": "openai:right"})
    with RunDirectory.locked(run_directory.path, other) as again:
        assert again.manifest == other
        file.parent.mkdir(exist_ok=True)
        with closing(sqlite3.connect(file)) as database:
            database.execute("CREATE TABLE Cache (key TEXT)")
            database.execute("INSERT INTO Cache VALUES ('a reply')")
            database.commit()
    with (
        pytest.raises(RunDirectoryError, match="its agent is"),
        RunDirectory.locked(run_directory.path, manifest),
    ):
        pass


def test_half_a_character_of_an_agent_is_kept_as_its_escape(run_directory, episode):
    record = episode(("end",), ("end",)).model_dump() | {"error": "half \ud800"}
    run_directory.write(EpisodeRecord.model_validate(record))
    (kept,) = run_directory.episodes()
    assert kept.error == r"half \ud800"
    step = StepRecord(verb="end", success=True, thought="\ud800", text="é\udc80")
    assert (step.thought, step.text) == (r"\ud800", r"é\udc80")


def test_a_disk_that_is_full_at_the_start_leaves_nothing(tmp_path, manifest):
    code = (
        "import resource, signal, sys\n"
        "from er_gym.rollout.run_directory import Manifest, RunDirectory\n"
        "from pathlib import Path\n"
        "signal.signal(signal.SIGXFSZ, signal.SIG_IGN)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (64, 64))\n"
        "manifest = Manifest.model_validate_json(sys.argv[2])\n"
        "with RunDirectory.locked(Path(sys.argv[1]), manifest): pass\n"
    )
    out = tmp_path / "run"
    command = [sys.executable, "-c", code, out, manifest.model_dump_json()]
    ended = subprocess.run(command, capture_output=True, text=True)
    assert "CannotWrite" in ended.stderr
    assert not out.exists()
