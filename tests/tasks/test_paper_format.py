from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tasks_by_hand import MUG, SINK, wash_mug

from er_gym.tasks import AgentPose, KeyAction, Task, TaskFileError, load_suite, task_type, verbs
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.goal import Condition
from er_gym.tasks.paper_format import read_poses, read_tasks, with_poses, write_poses, write_tasks

OWN = wash_mug(
    "FloorPlan4",
    goal=(
        Condition(
            "Mug", MUG, inside="SinkBasin", state=(("isDirty", False), ("fillLiquid", "water"))
        ),
        Condition("Plate", held=True),
        Condition("Faucet", in_reach=True, state=(("isToggled", True),)),
    ),
    arrangement=Arrangement(
        "FloorPlan4-7",
        {"Mug_1": ObjectPose(-0.3799, 1.1, 3.1868, yaw=359.9999), "Pot_2": ObjectPose(1, 2, 3)},
        (MUG, "Plate|+01.00|+01.00|+01.00"),
    ),
)
"""A task that has all that the paper's format has no field for."""
BARE = Task(
    "look", task_type("single_search"), "FloorPlan301", "Look for a Pen.", (KeyAction(verbs.END),)
)


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


def test_generated_tasks_are_written_for_the_papers_code_and_read_again(tmp_path: Path) -> None:
    tasks = list(load_suite("mini").tasks)
    path = tmp_path / "own.json"
    write_tasks(path, tasks)
    assert read_tasks(path) == tasks
    data = json.loads(path.read_text(encoding="utf-8"))
    assert [task["identity"] for task in data] == list(range(1, len(tasks) + 1))
    assert [task["taskquery"] for task in data] == [task.instruction for task in tasks]


OWN_TASKS = {
    "all fields": OWN,
    "few fields": BARE,
    "an id as the paper's": replace(BARE, id="paper-1"),
    "an identity": replace(OWN, extra={"identity": 3}),
    "an identity that the id repeats": replace(OWN, id="paper-3", extra={"identity": 3}),
    "more fields": replace(OWN, extra={"colour": "blue", "sizes": [1, {"a": None}]}),
    "fields that have a place": replace(OWN, extra={"scene": "FloorPlan9", "er_gym": 1}),
    "metadata": replace(OWN, extra={"task_metadata": {"totalreward": 9, "actions": 0}}),
    "odd metadata": replace(OWN, extra={"task_metadata": 1, "actions": [1, {"reward": 7}, {}]}),
    "no words": replace(OWN, instruction="", goal=(), arrangement=Arrangement()),
    "dirty alone": replace(BARE, arrangement=Arrangement(dirty=(MUG,))),
    "poses without a name": replace(
        BARE, arrangement=Arrangement(poses={"Mug_1": ObjectPose(1, 2, 3)})
    ),
    "a goal alone": replace(BARE, goal=(Condition("Pen", in_reach=True),)),
}


@pytest.mark.parametrize("task", OWN_TASKS.values(), ids=OWN_TASKS)
def test_writing_and_reading_gives_back_tasks_of_any_origin(task: Task, tmp_path: Path) -> None:
    path, again = tmp_path / "own.json", tmp_path / "again.json"
    write_tasks(path, [task])
    assert read_tasks(path) == [task]
    write_tasks(again, read_tasks(path))
    assert json.loads(again.read_text()) == json.loads(path.read_text())


def test_the_papers_tasks_stay_equal_whatever_becomes_of_them(
    write: Callable[[object], Path], tmp_path: Path
) -> None:
    (task,) = read_tasks(write([paper_task()]))
    tasks = [
        task,
        replace(task, id="again"),
        replace(task, id="paper-58", extra={**task.extra, "identity": 58}, goal=OWN.goal),
        replace(task, id="short", key_actions=task.key_actions[1:]),
        replace(task, id="other", key_actions=task.key_actions[::-1]),
    ]
    path = tmp_path / "changed.json"
    write_tasks(path, tasks)
    assert read_tasks(path) == tasks
    data = json.loads(path.read_text())
    assert data[0] == paper_task()
    assert set(data[2]["er_gym"]) == {"goal"}


def test_what_the_papers_format_has_no_field_for_lies_under_one_key(tmp_path: Path) -> None:
    path = tmp_path / "own.json"
    write_tasks(path, [OWN, BARE])
    own, bare = json.loads(path.read_text(encoding="utf-8"))
    assert own["er_gym"] == {
        "id": OWN.id,
        "goal": [
            {
                "object_type": "Mug",
                "object_id": MUG,
                "inside": "SinkBasin",
                "state": {"isDirty": False, "fillLiquid": "water"},
            },
            {"object_type": "Plate", "held": True},
            {"object_type": "Faucet", "in_reach": True, "state": {"isToggled": True}},
        ],
        "layout": "FloorPlan4-7",
        "layout_poses": {
            "Mug_1": [-0.3799, 1.1, 3.1868, 0.0, 359.9999, 0.0],
            "Pot_2": [1, 2, 3, 0.0, 0.0, 0.0],
        },
        "dirty": list(OWN.arrangement.dirty),
    }
    assert bare["er_gym"] == {"id": "look"}


def test_a_place_that_is_anothers_identity_is_not_given_twice(tmp_path: Path) -> None:
    pose = AgentPose(0.25, 0.9, -1.5, 180.0)
    tasks = [
        replace(BARE, id="a", extra={"identity": 2}, poses={MUG: pose}),
        replace(BARE, id="b", poses={SINK: pose}),
        replace(BARE, id="c"),
    ]
    write_tasks(tmp_path / "tasks.json", tasks)
    write_poses(tmp_path / "poses.json", tasks)
    identities = [task["identity"] for task in json.loads((tmp_path / "tasks.json").read_text())]
    assert identities == [2, 5, 3]
    again = read_tasks(tmp_path / "tasks.json")
    assert again == [replace(task, poses={}) for task in tasks]
    assert with_poses(again, read_poses(tmp_path / "poses.json")) == tasks


def test_a_task_that_could_not_be_read_again_is_not_written(tmp_path: Path) -> None:
    path = tmp_path / "tasks.json"
    with pytest.raises(TaskFileError, match=r"task 2 .*wrong field 'identity"):
        write_tasks(path, [OWN, replace(BARE, extra={"identity": [1]})])
    assert not path.exists()


def without(field: str) -> dict[str, Any]:
    return {name: value for name, value in paper_task().items() if name != field}


def with_action(**changes: Any) -> dict[str, Any]:
    task = paper_task()
    task["task_metadata"]["actions"][1].update(changes)
    return task


def with_own(**fields: Any) -> list[dict[str, Any]]:
    return [paper_task(er_gym=fields)]


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
    "task type": ([paper_task(tasktype="dance")], "unknown task type 'dance'; choose one of: "),
    "scene": ([paper_task(scene="FloorPlan31")], "unknown scene 'FloorPlan31'; choose one "),
    "verb": ([with_action(action="hop")], "unknown action 'hop'; choose one of: navigate to"),
    "same identity": (
        [paper_task(), paper_task()],
        "task 2 (identity 57) has the id 'paper-57', as task 1 (identity 57) has",
    ),
    "the generator's": (
        [paper_task()["task_metadata"]],
        "not a test file: no task has a scene or task_metadata; if the paper's generator",
    ),
    "own: no object": (
        [paper_task(er_gym=[])],
        "task 1 (identity 57) has a wrong field 'er_gym': input should be",
    ),
    "own: unknown field": (with_own(gaol=[]), "'er_gym.gaol': there is no such field (did you"),
    "own: no list": (with_own(goal={}), "has a wrong field 'er_gym.goal': input should be"),
    "own: empty condition": (with_own(goal=[{}]), "lacks field 'er_gym.goal[0].object_type'"),
    "own: short pose": (
        with_own(layout_poses={"Mug_1": [1, 2, 3]}), "lacks field 'er_gym.layout_poses.Mug_1[3]'",
    ),
    "own: id": (with_own(id="a/b"), "the task id 'a/b', which cannot be a file name"),
    "own: type": (with_own(type="dance"), "unknown task type 'dance'; choose one of: "),
    "own: scene": (with_own(scene="Home"), "unknown scene 'Home'; choose one of FloorPlan1-30"),
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
