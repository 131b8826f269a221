"""``er-gym unity``, with er-gym's player in the place of Unity's build."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

import er_gym
from benchmarks.cli.main import cli
from benchmarks.unity.captures import load, picture_file, room_file

SCENE = "FloorPlan424"  # few objects


def er(*words: object) -> Result:
    return CliRunner().invoke(cli, [*map(str, words)], standalone_mode=False)


@pytest.fixture(scope="module")
def captures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("unity") / "captures"
    ended = er(
        "unity", "collect", "--out", out, "--scenes", SCENE, "--poses", 2, "--width", 64,
        "--height", 48, "--program", er_gym.thor_executable(),
    )  # fmt: skip
    assert ended.exception is None, ended.output
    return out


def figures(report: str) -> dict[str, str]:
    """The last column of the first table by the first one."""
    rows = [line.strip("| ").split(" | ") for line in report.splitlines() if line.startswith("| ")]
    first = rows[: next((i for i, row in enumerate(rows[1:], 1) if row[0] == "Figure"), None)]
    return {row[0]: row[-1] for row in first}


def test_the_player_agrees_with_the_engine_in_everything(captures: Path, tmp_path: Path) -> None:
    ended = er("unity", "compare", captures, "--out", tmp_path / "report.md")
    assert ended.exception is None, ended.output
    told = figures((tmp_path / "report.md").read_text("utf-8"))
    assert len(told) == 18
    assert {value for name, value in told.items() if name not in ("Figure", "---")} == {"100.00"}
    assert (tmp_path / "report" / f"{SCENE}.png").is_file()


def test_a_view_is_that_of_its_pose(captures: Path) -> None:
    room = load(captures, SCENE)
    assert [view["error"] for view in room.views] == ["", ""]
    with er_gym.make_controller(width=64, height=48) as controller:
        controller.reset(SCENE)
        for view, picture in zip(room.views, room.pictures, strict=True):
            event = controller.step("TeleportFull", **view["pose"], forceAction=True)
            seen = {each["objectId"] for each in event.metadata["objects"] if each["visible"]}
            assert {*view["visible"]} == seen
            assert (picture == event.frame).all()
    assert (room.pictures[0] != room.pictures[1]).any()


def test_what_is_captured_already_is_left_as_it_is(captures: Path) -> None:
    before = room_file(captures, SCENE).stat().st_mtime_ns
    told = json.loads((captures / "captures.json").read_text())
    words = [word for name in ("poses", "width", "height") for word in (f"--{name}", told[name])]
    ended = er(
        "unity", "collect", "--out", captures, "--scenes", SCENE, *words,
        "--program", er_gym.thor_executable(),
    )  # fmt: skip
    assert "1 of 1 rooms are there" in ended.output
    assert room_file(captures, SCENE).stat().st_mtime_ns == before
    ended = er("unity", "collect", "--out", captures, "--scenes", SCENE, "--poses", 3)
    assert "other settings" in str(ended.exception)


def test_a_difference_is_counted(captures: Path, tmp_path: Path) -> None:
    room = load(captures, SCENE)
    told = json.loads(room_file(captures, SCENE).read_text())
    told["metadata"]["objects"][0]["position"]["x"] += 0.02
    told["metadata"]["objects"][1]["name"] += "x"
    told["reachable"].append([50.0, 0.9, 50.0])
    told["views"][0]["visible"].append("Fridge|of another room")
    changed = tmp_path / "captures"
    (changed / "rooms").mkdir(parents=True)
    (changed / "pictures").mkdir()
    (changed / "captures.json").write_bytes((captures / "captures.json").read_bytes())
    room_file(changed, SCENE).write_text(json.dumps(told))
    for number in range(len(room.views)):
        picture = picture_file(captures, SCENE, number)
        picture_file(changed, SCENE, number).write_bytes(picture.read_bytes())
    ended = er("unity", "compare", changed)
    assert ended.exception is None, ended.output
    wrong = {name for name, value in figures(ended.output).items() if value.startswith("9")}
    assert wrong == {
        "objects with the same name",
        "objects within 1 cm",
        "reachable positions of Unity that are ours",
        "visible objects of Unity that are ours",
    }


def test_bad_input_is_told(tmp_path: Path) -> None:
    assert "no room FloorPlan999" in str(
        er("unity", "collect", "--out", tmp_path / "a", "--scenes", "FloorPlan999").exception
    )
    assert "no captures" in str(er("unity", "compare", tmp_path).exception)
    (tmp_path / "captures.json").write_text('{"format": "er-gym/unity-captures/1"}')
    assert "lacks a setting" in str(er("unity", "compare", tmp_path).exception)


def test_doctor_names_each_part() -> None:
    output = er("unity", "doctor").output
    for part in ("build CloudRendering", "Vulkan library", "Vulkan drivers", "display", "disk"):
        assert part in output
