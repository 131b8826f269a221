"""Suites with tasks that are wrong: what can be played is, and the rest is told."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from support import with_ids

from benchmarks.cli.suites import fitted_tasks
from er_gym.tasks import Task, load_suite, suite_from_file
from er_gym.tasks.jsonl_format import write_tasks
from er_gym.tasks.resolve import ResolvedTasks

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def er_gym(er_gym: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Command:
    """Runs the command in ``tmp_path``."""
    monkeypatch.chdir(tmp_path)
    return er_gym


def about_a_ghost(task: Task, **fields: Any) -> Task:
    ghost = replace(task.key_actions[1], object_id="Egg|+09.00|+09.00|+09.00")
    keys = (task.key_actions[0], ghost, task.key_actions[2])
    return replace(task, key_actions=keys, **fields)


def elsewhere(task: Task, metres: float) -> Task:
    """The task with its first object a little off, as in another build."""
    first = task.key_actions[0].object_id
    kind, x, *rest = first.split("|")
    off = "|".join([kind, f"{float(x) + metres:+06.2f}", *rest])

    def moved(object_id: str) -> str:
        return off if object_id == first else object_id

    return with_ids(task, moved)


@pytest.fixture
def tasks() -> list[Task]:
    """Three tasks as they should be."""
    good = (
        task
        for task in load_suite("mini").tasks
        if task.type.name == "single_pickup" and not task.arrangement.poses
    )
    return list(islice(good, 3))


@pytest.fixture
def mixed(tasks: list[Task], tmp_path: Path) -> Path:
    """Two tasks as they should be, one that is 3 cm off, one about a ghost, and two that cannot be
    read: of an unknown type, and with an id that is there already."""
    one, two, three = tasks
    file = tmp_path / "mixed.jsonl"
    write_tasks(file, [one, elsewhere(two, 0.03), about_a_ghost(three, id="ghost"), three])
    header, *lines = file.read_text(encoding="utf-8").splitlines()
    odd = json.loads(lines[0]) | {"id": "dancing", "type": "dance"}
    header = json.dumps(json.loads(header) | {"tasks": 6})
    text = "\n".join([header, *lines, json.dumps(odd), lines[0]])
    file.write_text(text + "\n", encoding="utf-8")
    return file


@pytest.mark.parametrize("name", ["show", "verify"])
def test_a_file_without_a_task_that_can_be_played_is_told(
    name: str, er_gym: Command, tasks: list[Task], tmp_path: Path
) -> None:
    write_tasks(tmp_path / "ghosts.jsonl", [about_a_ghost(tasks[0])])
    code, out, err = er_gym("tasks", name, "ghosts.jsonl")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "Egg|+09.00|+09.00|+09.00" in err


def test_verify_plays_what_can_be_played(er_gym: Command, mixed: Path) -> None:
    code, out, err = er_gym("tasks", "verify", mixed, "--workers", 1)
    assert code == 1
    *aside, last = out.splitlines()
    assert last == "mixed: 3 of 6 tasks can be done; 3 set aside"
    assert [line.split(": ")[:3] for line in aside] == [
        ["mixed", "set aside", "dancing"],
        ["mixed", "set aside", aside[1].split(": ")[2]],
        ["mixed", "set aside", "ghost"],
    ]
    assert "unknown task type 'dance'" in aside[0]
    assert "the task in line 7 has the id" in aside[1]
    assert "no object 'Egg|+09.00|+09.00|+09.00'" in aside[2]
    assert len(re.findall(r", 0\.03 m off, is used instead \(", err)) == 1


def test_show_stats_and_convert_leave_out_what_cannot_be_read(
    er_gym: Command, mixed: Path, tmp_path: Path
) -> None:
    code, out, err = er_gym("tasks", "convert", mixed, "out.json")
    assert (code, out) == (0, "4 tasks: out.json\n")
    assert err.count("set aside") == 2
    assert "dancing" in err
    again = suite_from_file("out.json")
    assert [task.id for task in again.tasks] == [t.id for t in suite_from_file(mixed).tasks]
    assert again.set_aside == ()
    code, _, err = er_gym("tasks", "stats", mixed)
    assert (code, err.count("set aside")) == (0, 2)
    code, out, err = er_gym("tasks", "show", mixed, "--limit", 9)
    assert code == 0
    assert sum(task.id in out.splitlines() for task in again.tasks) == 3
    assert err.count("set aside") == 3
    code, out, err = er_gym("tasks", "show", mixed, "ghost", again.tasks[0].id)
    assert (code, err.count("set aside")) == (0, 1)
    code, out, err = er_gym("tasks", "show", mixed, "dancing")
    assert (code, out, err.count("\n")) == (2, "", 1)


def test_bench_plays_what_can_be_played_and_says_so_everywhere(
    er_gym: Command, mixed: Path, tmp_path: Path
) -> None:
    command = ["bench", "--tasks-file", mixed, "--agent", "oracle", "--out", "run"]
    code, out, err = er_gym(*command)
    assert code == 0
    assert err.count("set aside") == 3
    assert err.count("is used instead") == 1
    for text in (out, er_gym("report", "run", "--format", "md")[1]):
        assert "3 of the suite's tasks set aside and not counted" in text
        assert "set aside: ghost: FloorPlan" in text
        assert "0.03 m off, is used instead" in text
    rows = list(csv.DictReader(io.StringIO(er_gym("report", "run", "--format", "csv")[1])))
    assert [row["n"] for row in rows if row["level"] == "overall"] == ["3"]
    levels = [row["level"] for row in rows]
    assert (levels.count("set aside"), levels.count("taken")) == (3, 1)
    (run,) = json.loads(er_gym("report", "run", "--format", "json")[1])["runs"]
    assert run["episodes"] == run["manifest"]["suite_size"] == 3
    assert run["manifest"]["set_aside"][0]["task"] == "dancing"
    (taken,) = run["manifest"]["taken"]
    assert taken["metres"] == 0.03

    next((tmp_path / "run" / "episodes").glob("*.json")).unlink()
    assert er_gym(*command)[0] == 0  # goes on where it was
    assert len(list((tmp_path / "run" / "episodes").glob("*.json"))) == 3
    code, _, err = er_gym(*command, "--task-ids", "ghost")
    assert (code, err.count("\n")) == (2, 1)
    assert "no object 'Egg" in err
    assert er_gym(*command, "--task-ids", f"ghost,{taken['task_id']}")[0] == 0


def test_what_comes_with_er_gym_is_played_without_a_look_at_its_rooms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def look(tasks: object, backend: str) -> ResolvedTasks:
        raise LookupError(backend)

    monkeypatch.setattr("er_gym.tasks.resolve.resolve_tasks", look)
    suite = load_suite("mini")
    assert fitted_tasks(suite) == ResolvedTasks(suite.tasks)
    with pytest.raises(LookupError, match="unity"):
        fitted_tasks(suite, "unity")
    with pytest.raises(LookupError, match="embedded"):
        fitted_tasks(replace(suite, tasks=(replace(suite.tasks[0], name="?"),)))
