"""The paper's raw files: written, and read back."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from er_gym.data.collection import Collection
from er_gym.data.exports import export
from er_gym.data.exports.paper_reader import read_paper
from er_gym.data.trajectory import PictureRecord, Trajectory
from er_gym.tasks import verbs
from er_gym.tasks.errors import TaskFileError


@pytest.fixture(scope="module")
def folder(collection: Collection, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("paper") / "out"
    export(collection, "paper", out)
    return out / "train"


def held(trajectory: Trajectory) -> dict[str, object]:
    """What the layout has a place for."""
    pictures = [[each.direction for each in turn.pictures] for turn in trajectory.turns]
    return {
        "thoughts": [
            [(each.kind, each.text) for each in turn.thoughts] for turn in trajectory.turns
        ],
        "actions": [turn.action for turn in trajectory.turns],
        "success": [turn.success for turn in trajectory.turns],
        "rewards": [turn.reward for turn in trajectory.turns],
        "pictures": pictures,
        "keys": [(each.verb, each.object_id, each.reward) for each in trajectory.key_actions],
        "targets": trajectory.search_targets,
        "told": (trajectory.instruction, trajectory.name, trajectory.scene, trajectory.task_type),
        "verdict": (trajectory.success, trajectory.end_reason),
    }


def test_what_is_written_is_read_back(collection: Collection, folder: Path) -> None:
    written = {(each.scene, each.task_type): each for each in collection.trajectories()}
    read = list(read_paper(folder))
    assert len(read) == len(written)
    for each in read:
        before = written[each.scene, each.task_type]
        assert held(each) == held(before)
        for turn, was in zip(each.turns, before.turns, strict=True):
            for picture, old in zip(turn.pictures, was.pictures, strict=True):
                assert (folder / picture.path).read_bytes() == (
                    collection.path / old.path
                ).read_bytes()
                assert (picture.width, picture.height) == (old.width, old.height)
        ids = [turn.object_id for turn in each.turns[:-1]]
        shown = zip(ids, before.turns, before.turns[1:], strict=False)
        assert all(found == was.object_id for found, was, then in shown
                   if then.pictures and was.verb != verbs.OBSERVE)  # fmt: skip


def test_the_layout_is_the_papers(collection: Collection, folder: Path) -> None:
    for trajectory in collection.trajectories():
        kind = trajectory.task_type.replace(" ", "_")
        name = f"{trajectory.scene}_{kind}_0_{trajectory.kind}"
        place = folder / f"data_{kind}" / name
        [item] = json.loads((place / f"{name}.json").read_text())
        assert set(item) == {
            *("scene", "tasktype", "instruction_idx", "taskname", "trajectory", "images"),
            *("flag", "time", "task_metadata"),
        }
        assert "<DecisionMaking>end</DecisionMaking>" not in item["trajectory"]
        assert Path(item["images"][0]).name == "0_init_observe.jpeg"
        assert all((folder / image).is_file() for image in item["images"])
        for number, turn in enumerate(trajectory.turns[:-1], 1):
            after = [Path(each).stem for each in item["images"]
                     if Path(each).name.startswith(f"{number}_")]  # fmt: skip
            if not turn.success:
                assert after == []
            elif turn.verb == verbs.OBSERVE:
                angles = ["right_90", "left_180", "left_90"]
                assert after == [f"{number}_{angle}_observe" for angle in angles]
            else:
                assert len(after) == 1
                assert after[0].startswith(f"{number}_{turn.object_type}|")


def test_a_failed_episode_and_a_check_are_read_back(collection: Collection, tmp_path: Path) -> None:
    first = next(collection.trajectories())
    shot = first.turns[0].pictures
    going = first.turns[1].model_copy(update={"pictures": shot})
    step = going.model_copy(
        update={"verb": "move forward", "object_type": "", "object_id": "", "purpose": "check"}
    )
    ended = first.turns[-1].model_copy(update={"success": False, "reward": 0.0})
    failed = {"success": False, "end_reason": "end"}
    other = Collection.create(tmp_path / "other", collection.manifest)
    (other.path / "parts").symlink_to(collection.path / "parts")
    other.write([first.model_copy(update={"turns": [going, step, ended], **failed})])
    export(other, "paper", tmp_path / "out")
    [read] = read_paper(tmp_path / "out" / "train")
    assert [turn.purpose for turn in read.turns] == ["search", "check", "finish"]
    assert [len(turn.pictures) for turn in read.turns] == [1, 1, 1]
    assert [turn.success for turn in read.turns] == [True, True, False]
    assert not read.success
    assert any(path.name.endswith("_verify.jpeg") for path in tmp_path.rglob("1_*"))
    assert isinstance(read.turns[0].pictures[0], PictureRecord)


def test_put_may_be_spelled_in_two_ways(folder: Path, tmp_path: Path) -> None:
    source = next(folder.glob("data_pickup_and_put/*/*.json"))
    text = source.read_text().replace("<DecisionMaking>put in ", "<DecisionMaking>put ")
    text = text.replace(source.parent.name, "copy")
    place = tmp_path / "data_pickup_and_put" / "copy"
    place.mkdir(parents=True)
    (place / "copy.json").write_text(text)
    for picture in source.parent.glob("*.jpeg"):
        (place / picture.name).write_bytes(picture.read_bytes())
    [read] = read_paper(tmp_path)
    assert verbs.PUT in [turn.verb for turn in read.turns]


def test_damaged_files_are_named(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match="holds none of the paper's"):
        list(read_paper(tmp_path))
    place = tmp_path / "data_x" / "y"
    place.mkdir(parents=True)
    source = next(folder.glob("data_single_search/*/*.json"))
    [good] = json.loads(source.read_text())
    for content, problem in (
        ("[]", "list of one trajectory"),
        ("{", "JSON"),
        (json.dumps([{**good, "trajectory": 3}]), "trajectory"),
        (json.dumps([{**good, "images": ["1_gone.png"]}]), "1_gone.png"),
        (json.dumps([{**good, "images": [],
                      "trajectory": ["<DecisionMaking>fly</DecisionMaking>"]}]), "fly"),
        (json.dumps([{**good, "images": [], "trajectory": [], "flag": "x"}]), "no decision"),
        (json.dumps([{**good, "tasktype": "dance"}]), "dance"),
    ):  # fmt: skip
        (place / "y.json").write_text(content)
        with pytest.raises(TaskFileError, match=problem) as raised:
            list(read_paper(tmp_path))
        assert "y.json" in str(raised.value)
