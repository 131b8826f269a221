from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from er_gym.tasks import TaskFileError, verbs
from er_gym.tasks.generate import generate_tasks
from er_gym.tasks.paper_format import read_poses, read_tasks, with_poses, write_poses, write_tasks
from er_gym.thor import accepts

MUG = "Mug|-00.38|+01.09|+03.19"
SINK = "Sink|-01.39|+00.98|+00.44|SinkBasin"


def paper_task(**changes: Any) -> dict[str, Any]:
    """A task as the paper's files have it, with a field that we have never heard of."""
    return {
        "scene": "FloorPlan4",
        "tasktype": "pickup_and_put",
        "instruction_idx": "0",
        "taskname": "put the Mug in the SinkBasin",
        "task_metadata": {
            "taskname": "put a Mug in the SinkBasin",
            "tasktype": "pickup_and_put",
            "metadatapath": "kitchens/FloorPlan4/metadata.json",
            "actions": [
                paper_action("navigate to", "", "", weather="fine"),
                paper_action("pickup", MUG, "Mug", baseaction="pickup"),
                paper_action("put", SINK, "Sink", relatedObject=[SINK, MUG]),
                paper_action("end", "", ""),
            ],
            "totalreward": 3,
        },
        "taskquery": "Please put the Mug into the SinkBasin.",
        "identity": 57,
        "target_objects": [SINK],
        "related_objects": [MUG],
        "navigable_objects": ["DiningTable", "DiningTable"],
        "colour": "blue",
        **changes,
    }


def paper_action(verb: str, object_id: str, object_type: str, **more: Any) -> dict[str, Any]:
    action = {"action": verb, "objectId": object_id, "objectType": object_type, "reward": 1}
    return {**action, "baseaction": "", "relatedObject": [], **more}


@pytest.fixture
def write(tmp_path: Path) -> Callable[[object], Path]:
    def write(data: object) -> Path:
        path = tmp_path / "tasks.json"
        path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
        return path

    return write


def test_a_task_says_what_its_file_says(write: Callable[[object], Path]) -> None:
    (task,) = read_tasks(write([paper_task()]))
    assert task.id == "paper-57"
    assert task.type.name == "pickup_and_put"
    assert task.scene == "FloorPlan4"
    assert task.instruction == "Please put the Mug into the SinkBasin."
    assert task.name == "put the Mug in the SinkBasin"
    assert [action.verb for action in task.key_actions] == [
        verbs.NAVIGATE, verbs.PICKUP, verbs.PUT, verbs.END,
    ]  # fmt: skip
    put = task.key_actions[2]
    assert (put.object_id, put.object_type, put.actual_type) == (SINK, "Sink", "SinkBasin")
    assert put.related_objects == (SINK, MUG)
    assert task.navigable_objects == ("DiningTable", "DiningTable")
    assert task.extra["identity"] == 57


def test_reading_and_writing_gives_back_the_file(
    write: Callable[[object], Path], tmp_path: Path
) -> None:
    odd_verb = paper_task(identity=58)
    odd_verb["task_metadata"]["actions"][2]["action"] = "put in"
    data = [paper_task(), odd_verb, paper_task(identity="59a", scene="FloorPlan4_physics")]
    again = tmp_path / "again.json"
    write_tasks(again, read_tasks(write(data)))
    assert json.loads(again.read_text()) == data


def test_reading_and_writing_gives_back_the_papers_own_file(
    shared_data: Path, tmp_path: Path
) -> None:
    original = shared_data / "paper_tasks_dev.json"
    tasks = read_tasks(original)
    assert len({task.id for task in tasks}) == len(tasks) == 272
    again = tmp_path / "again.json"
    write_tasks(again, tasks)
    assert json.loads(again.read_text()) == json.loads(original.read_text())


def test_what_a_file_leaves_out_has_its_default(write: Callable[[object], Path]) -> None:
    data = paper_task()
    for field in ("taskquery", "instruction_idx", "target_objects", "navigable_objects"):
        del data[field]
    for action in data["task_metadata"]["actions"]:
        del action["relatedObject"], action["reward"]
    (task,) = read_tasks(write([data]))
    assert task.instruction == task.name
    assert task.target_objects == task.navigable_objects == ()
    assert [action.reward for action in task.key_actions] == [1, 1, 1, 1]


def test_generated_tasks_can_be_written_for_the_papers_code(
    scene_objects: Callable[[str], list[dict[str, Any]]], tmp_path: Path
) -> None:
    tasks = list(generate_tasks(scene_objects("FloorPlan1"), "FloorPlan1", accepts))
    path = tmp_path / "own.json"
    write_tasks(path, tasks)
    again = read_tasks(path)
    assert [task.extra["identity"] for task in again] == list(range(1, len(tasks) + 1))
    assert [task.key_actions for task in again] == [task.key_actions for task in tasks]
    assert [task.instruction for task in again] == [task.instruction for task in tasks]


def without(field: str) -> dict[str, Any]:
    return {name: value for name, value in paper_task().items() if name != field}


def with_action(**changes: Any) -> dict[str, Any]:
    task = paper_task()
    task["task_metadata"]["actions"][1].update(changes)
    return task


WRONG = {
    "not JSON": ('[\n{"scene": }]', "not JSON: Expecting value (line 2, column 11)"),
    "not a list": ({"scene": "FloorPlan1"}, "not a list of tasks but an object"),
    "not a task": (["FloorPlan1"], "task 1 is 'FloorPlan1'"),
    "no scene": ([paper_task(), without("scene")], "task 2 (identity 57) lacks field 'scene'"),
    "no identity": ([without("identity")], "task 1 lacks field 'identity'"),
    "no actions": ([paper_task(task_metadata={})], "lacks field 'task_metadata.actions'"),
    "no verb": (
        [paper_task(task_metadata={"actions": [{"objectId": ""}]})],
        "lacks field 'task_metadata.actions[0].action'",
    ),
    "wrong field": ([paper_task(scene=7)], "wrong field 'scene': input should be a valid string"),
    "long wrong field": ([paper_task(target_objects={"a": "b" * 500})], "…"),
    "task type": ([paper_task(tasktype="dance")], "unknown tasktype 'dance'; choose one of: "),
    "scene": ([paper_task(scene="FloorPlan31")], "unknown scene 'FloorPlan31'; choose one "),
    "verb": ([with_action(action="hop")], "unknown action 'hop'; choose one of: navigate to"),
    "same identity": ([paper_task(), paper_task()], "2 tasks have the id 'paper-57'"),
    "bad identity": ([paper_task(identity="../x")], "cannot be a file name"),
}  # fmt: skip


@pytest.mark.parametrize(("data", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_file_gives_one_clear_line(
    data: object, message: str, write: Callable[[object], Path]
) -> None:
    path = write(data)
    with pytest.raises(TaskFileError) as caught:
        read_tasks(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert "pydantic" not in str(caught.value)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match=r"nowhere\.json: no such file"):
        read_tasks(tmp_path / "nowhere.json")
    with pytest.raises(TaskFileError, match="directory"):
        read_tasks(tmp_path)
    latin = tmp_path / "latin.json"
    latin.write_bytes(b'["\xe9"]')
    with pytest.raises(TaskFileError, match="not UTF-8"):
        read_tasks(latin)


def test_poses_are_read_attached_and_written(
    write: Callable[[object], Path], tmp_path: Path
) -> None:
    pose = {
        "agent_teleport_position": {"x": 0.25, "y": 0.9, "z": -1.5},
        "agent_cameraHorizon": -18.0,
        "agent_isstanding": False,
        "agent_rotation": {"x": 0.0, "y": 180.0, "z": 0.0},
    }
    task = paper_task()
    entry = {name: task[name] for name in ("scene", "tasktype", "taskname")}
    data = {"57": {**entry, MUG: pose}}
    (tmp_path / "poses.json").write_text(json.dumps(data))

    poses = read_poses(tmp_path / "poses.json")
    tasks = with_poses(read_tasks(write([task, paper_task(identity=58)])), poses)
    assert (tasks[0].poses[MUG].z, tasks[0].poses[MUG].rotation) == (-1.5, 180.0)
    assert (tasks[0].poses[MUG].horizon, tasks[0].poses[MUG].standing) == (-18.0, False)
    assert not tasks[1].poses

    write_poses(tmp_path / "again.json", tasks)
    assert json.loads((tmp_path / "again.json").read_text()) == data


def test_the_papers_own_poses_are_read(shared_data: Path) -> None:
    poses = read_poses(shared_data / "agent_positions.json")
    assert len(poses) == 50
    tasks = with_poses(read_tasks(shared_data / "paper_tasks_dev.json"), poses)
    assert sum(bool(task.poses) for task in tasks) == 16


def test_a_wrong_pose_file_gives_one_clear_line(write: Callable[[object], Path]) -> None:
    with pytest.raises(TaskFileError, match="not an object of poses but a list"):
        read_poses(write([]))
    entry = {"scene": "FloorPlan4", "tasktype": "", "taskname": "", MUG: {}}
    with pytest.raises(TaskFileError, match=r"poses of task '57': lacks field 'Mug\|.*position'"):
        read_poses(write({"57": entry}))
