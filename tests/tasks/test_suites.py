from __future__ import annotations

import gzip
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from floor_plan_1 import PLATE

from er_gym.tasks import (
    AgentPose,
    KeyAction,
    Task,
    TaskFileError,
    load_suite,
    suite_from_file,
    suites,
    task_type,
    verbs,
)
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.generate import GENERATED_TYPES
from er_gym.tasks.goal import Condition
from er_gym.tasks.jsonl_format import FORMAT, digest, read_tasks, write_tasks
from er_gym.tasks.paper_format import write_tasks as write_paper_tasks
from er_gym.tasks.room_kinds import ROOM_KINDS, room_kind

TASK = Task(
    id="FloorPlan1-a",
    type=task_type("pickup_and_put"),
    scene="FloorPlan1",
    instruction="Bring the café’s Cup to the Plate.",
    name="put the Cup on the Plate",
    key_actions=(
        KeyAction(verbs.PICKUP, "Cup|+00.37|+01.64|-02.58", "Cup", reward=0.5),
        KeyAction(verbs.PUT, PLATE, "", (PLATE,)),
        KeyAction(verbs.END),
    ),
    target_objects=(PLATE,),
    navigable_objects=("Fridge",),
    poses={PLATE: AgentPose(0.25, 0.9, -1.5, 180.0, horizon=-18.0)},
    extra={"identity": 3},
)
HEADER = {"format": FORMAT, "tasks": 1}


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., Path]:
    def write(*lines: object) -> Path:
        path = tmp_path / "tasks.jsonl"
        text = "\n".join(line if isinstance(line, str) else json.dumps(line) for line in lines)
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_reading_gives_back_what_was_written(tmp_path: Path) -> None:
    path = tmp_path / "own.jsonl"
    tasks = [TASK, replace(TASK, id="b", poses={}, extra={})]
    write_tasks(path, tasks, seed=3)
    assert read_tasks(path) == tasks
    header = json.loads(path.read_text(encoding="utf-8").splitlines()[0])
    assert header == {"format": "er-gym/tasks/1", "tasks": 2, "seed": 3}


def test_an_empty_object_type_is_kept_and_a_usual_one_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "own.jsonl"
    write_tasks(path, [TASK])
    actions = json.loads(path.read_text(encoding="utf-8").splitlines()[1])["key_actions"]
    assert "object_type" not in actions[0]
    assert actions[1]["object_type"] == ""


def test_the_digest_is_that_of_what_is_asked(tmp_path: Path) -> None:
    assert digest([TASK]) == digest([replace(TASK, extra={})])
    assert digest([TASK]) != digest([replace(TASK, instruction="Sit.")])
    assert digest([TASK, replace(TASK, id="b")]) != digest([replace(TASK, id="b"), TASK])


def test_the_digest_does_not_depend_on_the_format(tmp_path: Path) -> None:
    paper, own = tmp_path / "x.json", tmp_path / "x.jsonl"
    write_paper_tasks(paper, [TASK])
    from_paper = suite_from_file(paper)
    write_tasks(own, from_paper.tasks)
    assert suite_from_file(own).digest == from_paper.digest
    assert from_paper.name == "x"


TASK_LINE = {"id": "a", "type": "single_toggle", "scene": "FloorPlan1", "instruction": "Toggle."}
WRONG = {
    "empty": ([], "empty; its first line should be"),
    "no header": ([{**TASK_LINE, "key_actions": []}], "the header lacks field 'format'"),
    "newer": ([{**HEADER, "format": "er-gym/tasks/9"}], "format 'er-gym/tasks/9'; this er-gym"),
    "cut short": ([HEADER], "its header says 1 tasks, and it has 0"),
    "not JSON": ([HEADER, "", '{"id": '], "not JSON: Expecting value (line 3, column 8)"),
    "no layout": (
        [HEADER, {**TASK_LINE, "key_actions": [], "layout": "x"}],
        "the task in line 2 names a layout that no earlier line defines",
    ),
    "wrong layout": (
        [HEADER, {"layout": "x", "poses": {"Apple": [1, 2]}}],
        "the layout in line 2 lacks field 'poses.Apple[2]'",
    ),
    "lacks field": ([HEADER, TASK_LINE], "the task in line 2 lacks field 'key_actions'"),
    "misspelled": (
        [HEADER, {**TASK_LINE, "key_actions": [], "poise": 1}],
        "the task in line 2 has a wrong field 'poise'",
    ),
    "verb": (
        [HEADER, {**TASK_LINE, "key_actions": [{"verb": "hop"}]}],
        "the task in line 2 has unknown action 'hop'",
    ),
}  # fmt: skip


@pytest.mark.parametrize(("lines", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_file_gives_one_clear_line(
    lines: list[object], message: str, write: Callable[..., Path]
) -> None:
    with pytest.raises(TaskFileError) as caught:
        suite_from_file(write(*lines))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match=r"ends in \.json \(the paper's format\), \.jsonl or"):
        suite_from_file(tmp_path / "tasks.csv")


def test_the_last_version_of_each_suite_is_that_of_its_tasks() -> None:
    for name in suites.suite_names():
        if suites.suite_file(name).exists():
            found = suites.suite_version(name, load_suite(name).digest)
            assert found == len(suites.suite_config(name).versions) > 0, name
    assert suites.suite_version("mini", "0" * 64) is None
    assert suites.suite_version("of another package", "0" * 64) is None


def test_an_unknown_suite_is_answered_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"unknown suite 'maxi'; choose one of: .*mini"):
        load_suite("maxi")
    with pytest.raises(ValueError, match=r"unknown suite '\.\./mini'"):
        load_suite("../mini")


def test_a_suite_that_is_not_made_says_how_to_make_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ER_GYM_HOME", str(tmp_path))
    monkeypatch.setattr(suites, "_DATA", tmp_path)  # as if it did not come with er-gym
    with pytest.raises(TaskFileError, match="run: er-gym tasks generate --suite train"):
        load_suite("train")
    (tmp_path / "suites").mkdir()
    write_tasks(tmp_path / "suites" / "train.jsonl.gz", [TASK])
    assert load_suite("train").tasks == (TASK,)


MOVED = Arrangement("FloorPlan1-7", {"Apple_1": ObjectPose(1.0, 0.9, -1.25, yaw=90.0)})


def test_a_start_and_a_goal_are_kept(tmp_path: Path) -> None:
    path = tmp_path / "own.jsonl.gz"
    goal = (
        Condition("Cup", held=True, state=(("isDirty", False), ("fillLiquid", "water"))),
        Condition("Plate", PLATE, in_reach=True, inside="Shelf"),
    )
    first = replace(TASK, goal=goal, arrangement=replace(MOVED, dirty=(PLATE,)))
    tasks = [
        first,
        replace(first, id="b", arrangement=MOVED),
        replace(first, id="c", arrangement=Arrangement()),
    ]
    write_tasks(path, tasks)
    assert read_tasks(path) == tasks
    lines = gzip.decompress(path.read_bytes()).decode().splitlines()
    assert [("poses" in line) for line in lines].count(True) == 4  # the layout, and three tasks'
    assert sum('"layout":' in line and '"id":' not in line for line in lines) == 1
    assert digest(tasks) != digest([replace(first, arrangement=Arrangement()), *tasks[1:]])


def test_one_name_for_two_arrangements_is_refused(tmp_path: Path) -> None:
    other = replace(
        TASK, id="b", arrangement=replace(MOVED, poses={"Apple_1": ObjectPose(0, 0, 0)})
    )
    with pytest.raises(ValueError, match="task b: another arrangement is named 'FloorPlan1-7'"):
        write_tasks(tmp_path / "own.jsonl", [replace(TASK, arrangement=MOVED), other])
    assert list(tmp_path.iterdir()) == []


def test_the_same_tasks_give_the_same_bytes(tmp_path: Path) -> None:
    one, other = tmp_path / "one.jsonl.gz", tmp_path / "other.jsonl.gz"
    write_tasks(one, [TASK])
    write_tasks(other, [TASK])
    assert one.read_bytes() == other.read_bytes()


def test_what_is_no_whole_gzip_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "cut.jsonl.gz"
    write_tasks(path, [TASK])
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(TaskFileError, match="not a whole gzip file"):
        read_tasks(path)
    path.write_text("hello")
    with pytest.raises(TaskFileError, match="not a whole gzip file"):
        read_tasks(path)


@pytest.mark.parametrize("name", ["mini", "er-1k"])
def test_a_bundled_suite_loads(name: str, repository: Path) -> None:
    suite = load_suite(name)
    assert (suite.name, suite.digest) == (name, digest(suite.tasks))
    config = yaml.safe_load((repository / "configs" / "suites" / f"{name}.yaml").read_text())
    assert (suite.description, suite.env) == (config["description"], config["env"])
    assert suite.env == load_suite("mini").env
    assert not any(task.navigable_objects or task.poses for task in suite.tasks)


def test_mini_has_all_types_and_all_kinds_of_room() -> None:
    tasks = load_suite("mini").tasks
    assert len(tasks) >= 100
    per_type = Counter(task.type for task in tasks)
    assert set(per_type) == set(GENERATED_TYPES)
    assert max(per_type.values()) <= 2 * min(per_type.values())
    assert {room_kind(task.scene) for task in tasks} == set(ROOM_KINDS)


ENDS_OF_LINES = [chr(code) for code in range(0x110000) if len(f"a{chr(code)}b".splitlines()) > 1]
"""All that Python, or Unicode, takes for an end of line."""


@pytest.mark.parametrize("end", [*ENDS_OF_LINES, "\r\n", "\ufeff", "\0"], ids=ascii)
@pytest.mark.parametrize("name", ["tasks.jsonl", "tasks.jsonl.gz", "tasks.json"])
def test_what_is_written_is_read(end: str, name: str, tmp_path: Path) -> None:
    text = f"{end}Bring{end}the Cup{end * 2}to the Plate.{end}"
    extra = {"identity": 3, "note": text, text: [text]}
    odd = replace(TASK, instruction=text, name=text, target_objects=(text,), extra=extra)
    tasks = [replace(odd, poses={}), replace(TASK, id="FloorPlan1-b", poses={})]
    writer = write_paper_tasks if name.endswith(".json") else write_tasks
    writer(tmp_path / name, tasks)
    assert [each.instruction for each in suite_from_file(tmp_path / name).tasks] == [
        text,
        TASK.instruction,
    ]
    if name != "tasks.json":
        assert read_tasks(tmp_path / name) == tasks


def test_lines_may_end_as_on_windows(tmp_path: Path) -> None:
    path = tmp_path / "tasks.jsonl"
    write_tasks(path, [TASK])
    path.write_bytes(path.read_bytes().replace(b"\n", b"\r\n"))
    assert read_tasks(path) == [TASK]
