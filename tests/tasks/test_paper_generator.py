from __future__ import annotations

import json
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from tasks_by_hand import LONG, MUG, SINK, wash_mug

from er_gym.tasks import AgentPose, Task, TaskFileError, load_suite, task_type, verbs
from er_gym.tasks import paper_format as test_file
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.goal import Condition
from er_gym.tasks.paper_generator import read_generator_tasks, write_generator_tasks

LONG_FILE = "long-range_tasks_with_dependency_relationships_task_metadata.json"
ROOMS = {0: "kitchens", 2: "living_rooms", 3: "bedrooms", 4: "bathrooms"}
OWN = wash_mug(
    "FloorPlan204",
    navigable_objects=("Fridge", "Fridge"),
    goal=(Condition("Mug", MUG, inside="SinkBasin", state=(("isDirty", False),)),),
    arrangement=Arrangement("FloorPlan204-7", {"Mug_1": ObjectPose(-0.3799, 1.1, 3.1868)}, (MUG,)),
    poses={SINK: AgentPose(0.25, 0.9, -1.5, 180.0, horizon=-18.0)},
)


def generated(**changes: Any) -> dict[str, Any]:
    """A task as the paper's generator writes it, with fields that we have never heard of."""
    return {
        "taskname": "Look for the Mug in the room.",
        "tasktype": "single_search",
        "metadatapath": "taskgenerate/kitchens/FloorPlan1/metadata.json",
        "actions": [
            {
                "action": verb,
                "objectId": object_id,
                "objectType": "",
                "baseaction": "",
                "reward": 1,
                "relatedObject": [],
            }
            for verb, object_id in (("navigate to", SINK), ("put", SINK), ("end", ""))
        ],
        "totalreward": 7,
        "colour": "blue",
        **changes,
    }


def write(data: object, path: Path) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(data if isinstance(data, str) else json.dumps(data), encoding="utf-8")
    return path


def contents(folder: Path) -> dict[str, Any]:
    return {
        str(file.relative_to(folder)): json.loads(file.read_text(encoding="utf-8"))
        for file in folder.rglob("*.json")
    }


def by_id(tasks: list[Task]) -> list[Task]:
    return sorted(tasks, key=lambda task: task.id)


def test_a_task_says_what_its_file_says(tmp_path: Path) -> None:
    _, task = read_generator_tasks(write([generated(), generated()], tmp_path / "any.json"))
    assert (task.id, task.scene) == ("FloorPlan1-single_search-2", "FloorPlan1")
    assert task.type.name == "single_search"
    assert task.instruction == task.name == "Look for the Mug in the room."
    assert [action.verb for action in task.key_actions] == [verbs.NAVIGATE, verbs.PUT, verbs.END]
    assert (task.goal, task.arrangement, task.target_objects) == ((), Arrangement(), ())
    assert task.extra == {
        "task_metadata": {
            "totalreward": 7,
            "colour": "blue",
            "metadatapath": "taskgenerate/kitchens/FloorPlan1/metadata.json",
        },
        "actions": [{"baseaction": ""}] * 3,
    }


def test_an_id_has_no_spaces(tmp_path: Path) -> None:
    (task,) = read_generator_tasks(write([generated(tasktype=LONG)], tmp_path / "any.json"))
    assert task.id == "FloorPlan1-long-range_tasks_with_dependency_relationships-1"


@pytest.mark.parametrize("path", ["", "taskgenerate/{room}/{scene}/metadata.json", "FloorPlan99"])
def test_the_scene_is_the_folders_where_the_metadata_path_tells_none(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = write([generated(metadatapath=path)], tmp_path / "FloorPlan404" / "any.json")
    (task,) = read_generator_tasks(file)
    assert (task.scene, task.id) == ("FloorPlan404", "FloorPlan404-single_search-1")
    monkeypatch.chdir(file.parent)
    assert read_generator_tasks("any.json") == [task]


def test_reading_and_writing_gives_back_the_papers_own_tasks(
    shared_data: Path, tmp_path: Path
) -> None:
    groups: dict[tuple[str, str], list[dict[str, Any]]] = defaultdict(list)
    for task in json.loads((shared_data / "paper_tasks_dev.json").read_text(encoding="utf-8")):
        metadata = task["task_metadata"]
        groups[task["scene"], metadata["tasktype"]].append(metadata)
    for (scene, kind), group in groups.items():
        number = int(scene.removeprefix("FloorPlan"))
        name = f"{kind.replace(' ', '_')}_task_metadata.json"
        write(group, tmp_path / "original" / ROOMS[number // 100] / scene / name)

    tasks = read_generator_tasks(tmp_path / "original")
    assert len(tasks) == 272
    files = write_generator_tasks(tmp_path / "again", tasks)
    assert len(files) == len(groups)
    assert contents(tmp_path / "again") == contents(tmp_path / "original")
    assert read_generator_tasks(tmp_path / "again") == tasks


def test_the_papers_test_file_and_its_generators_files_turn_into_each_other(
    shared_data: Path, tmp_path: Path
) -> None:
    original = shared_data / "paper_tasks_dev.json"
    tasks = test_file.read_tasks(original)
    write_generator_tasks(tmp_path / "generated", tasks)
    again = read_generator_tasks(tmp_path / "generated")
    assert by_id(again) == by_id(tasks)

    test_file.write_tasks(tmp_path / "test.json", sorted(again, key=tasks.index))
    assert json.loads((tmp_path / "test.json").read_text()) == json.loads(original.read_text())


def test_what_the_generator_wrote_can_be_written_as_a_test_file(tmp_path: Path) -> None:
    data = [generated(), generated(taskname="Look for a Pen.")]
    tasks = read_generator_tasks(write(data, tmp_path / "any.json"))
    test_file.write_tasks(tmp_path / "test.json", tasks)
    assert test_file.read_tasks(tmp_path / "test.json") == tasks
    written = json.loads((tmp_path / "test.json").read_text())
    assert [task["task_metadata"] for task in written] == data


def test_generated_tasks_are_written_and_read_again(tmp_path: Path) -> None:
    tasks = list(load_suite("mini").tasks)
    files = write_generator_tasks(tmp_path, tasks)
    again = read_generator_tasks(tmp_path)
    assert by_id(again) == by_id(tasks)
    assert again == [task for file in files for task in read_generator_tasks(file)]
    numbers = [int(task.scene.removeprefix("FloorPlan")) for task in again]
    assert numbers == sorted(numbers)


OWN_TASKS = {
    "all fields": OWN,
    "an id as it would be": replace(OWN, id="FloorPlan204-" + LONG.replace(" ", "_") + "-1"),
    "an instruction as the name": replace(OWN, instruction=OWN.name),
    "nothing but words": Task("a", task_type("single_search"), "FloorPlan301", "Look.", ()),
    "no words": replace(OWN, instruction=""),
    "a scene with physics": replace(OWN, scene="FloorPlan204_physics"),
    "an identity": replace(OWN, extra={"identity": 3, "colour": "blue"}),
    "odd metadata": replace(OWN, extra={"task_metadata": 1, "actions": [{}]}),
    "another's metadata": replace(
        OWN, extra={"task_metadata": {**generated(), "er_gym": 5}, "actions": [{}, {}, {"a": 1}]}
    ),
}  # fmt: skip


@pytest.mark.parametrize("task", OWN_TASKS.values(), ids=OWN_TASKS)
def test_writing_and_reading_gives_back_tasks_of_any_origin(task: Task, tmp_path: Path) -> None:
    other = replace(task, id="other")
    write_generator_tasks(tmp_path / "own", [task, other])
    again = read_generator_tasks(tmp_path / "own")
    assert again == [task, other]
    write_generator_tasks(tmp_path / "again", again)
    assert contents(tmp_path / "again") == contents(tmp_path / "own")


def test_files_lie_as_the_papers_do(tmp_path: Path) -> None:
    search = replace(OWN, id="b", type=task_type("single_search"))
    bath = replace(OWN, id="c", scene="FloorPlan401")
    kitchen = replace(OWN, id="d", scene="FloorPlan5")
    files = write_generator_tasks(tmp_path, [bath, OWN, search, kitchen])
    assert [str(file.relative_to(tmp_path)) for file in files] == [
        f"kitchens/FloorPlan5/{LONG_FILE}",
        "living_rooms/FloorPlan204/single_search_task_metadata.json",
        f"living_rooms/FloorPlan204/{LONG_FILE}",
        f"bathrooms/FloorPlan401/{LONG_FILE}",
    ]
    (record,) = json.loads(files[-1].read_text(encoding="utf-8"))
    assert record["metadatapath"] == "taskgenerate/bathrooms/FloorPlan401/metadata.json"
    assert list(record) == [
        "taskname", "tasktype", "metadatapath", "actions", "totalreward", "er_gym",
    ]  # fmt: skip
    assert record["totalreward"] == 2.5
    assert record["er_gym"]["id"] == "c"
    assert record["er_gym"]["instruction"] == OWN.instruction


def test_other_files_of_a_folder_are_passed_over(tmp_path: Path) -> None:
    write({"objects": []}, tmp_path / "kitchens" / "FloorPlan1" / "metadata.json")
    write([], tmp_path / "kitchens" / "FloorPlan1" / "single_toggle_task_metadata.json")
    assert read_generator_tasks(tmp_path) == []


WRONG: dict[str, tuple[object, str]] = {
    "not JSON": ("[", "not JSON"),
    "not a list": ({}, "not a list of tasks but an object; the files of the paper's generator"),
    "not a task": ([7], "task 1 is 7"),
    "a test file": (
        [{"scene": "FloorPlan1", "task_metadata": generated()}],
        "this is a test file; read it with er_gym.tasks.paper_format.read_tasks",
    ),
    "no name": ([generated(), {"actions": []}], "task 2 lacks field 'taskname'"),
    "no actions": ([{"taskname": "", "tasktype": ""}], "task 1 lacks field 'actions'"),
    "no scene": (
        [generated(metadatapath="{scene}/metadata.json")],
        "task 1 names no scene: neither its metadatapath '{scene}/metadata.json' nor its folder",
    ),
    "task type": ([generated(tasktype="dance")], "unknown task type 'dance'; choose one of: "),
    "own": ([generated(er_gym={"gaol": []})], "task 1 has a wrong field 'er_gym.gaol'"),
    "same id": ([generated(er_gym={"id": "a"})] * 2, "task 2 has the id 'a', as task 1 has"),
}


@pytest.mark.parametrize(("data", "message"), WRONG.values(), ids=WRONG)
def test_a_wrong_file_gives_one_clear_line(data: object, message: str, tmp_path: Path) -> None:
    path = write(data, tmp_path / "any.json")
    with pytest.raises(TaskFileError) as caught:
        read_generator_tasks(path)
    assert message in str(caught.value)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)


def test_a_folder_without_files_and_a_file_that_is_not_there_are_named(tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match=r"no file of the paper's generator in this folder or"):
        read_generator_tasks(tmp_path)
    with pytest.raises(TaskFileError, match=r"nowhere: no such file"):
        read_generator_tasks(tmp_path / "nowhere")


def test_nothing_is_written_if_a_task_could_not_be_read_again(tmp_path: Path) -> None:
    wrong = replace(OWN, id="b", extra={"task_metadata": {"taskname": 5}})
    with pytest.raises(TaskFileError, match=r"task 2 has a wrong field 'taskname'"):
        write_generator_tasks(tmp_path, [OWN, wrong])
    assert list(tmp_path.iterdir()) == []
