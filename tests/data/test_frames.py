"""Frames: what is drawn, that it can be interrupted, and how it is told."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from agents.finetune.samples import open_samples
from agents.finetune.settings import DataSettings
from benchmarks.cli.main import cli
from er_gym import EmbodiedEnv
from er_gym.data import frame_camera
from er_gym.data.dialects import load_dialect
from er_gym.data.frame_chat import frame_chat, words_for_frames
from er_gym.data.frames import FRAMES, Frame, FrameSet
from er_gym.data.pictures import encode_picture
from er_gym.data.trajectory import PictureRecord, SeenObject
from er_gym.envs.info import with_details
from er_gym.tasks.jsonl_format import write_tasks
from er_gym.tasks.suites import load_suite

SUITE = load_suite("mini")
ROOMS = "FloorPlan402,FloorPlan405"
SIZE = ("--width", "96", "--height", "54")


def arguments(out: Path, number: int, *more: str) -> list[str]:
    options = {"--suite": "mini", "--frames": str(number), "--out": str(out), "--workers": "1"}
    pairs = [each for pair in options.items() for each in pair]
    return ["data", "frames", *pairs, "--scenes", ROOMS, *SIZE, *more]


def draw(out: Path, number: int, *more: str) -> Result:
    return CliRunner().invoke(cli, arguments(out, number, *more))


def files(path: Path) -> dict[str, bytes]:
    return {str(each.relative_to(path)): each.read_bytes() for each in path.rglob("*.jp*g")} | {
        FRAMES: (path / FRAMES).read_bytes()
    }


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("frames") / "drawn"
    result = draw(out, 40)
    assert result.exit_code == 0, result.output
    return out


def test_the_frames_are_the_same_after_a_kill_and_in_several_steps(
    drawn: Path, tmp_path: Path
) -> None:
    out = tmp_path / "again"
    assert draw(out, 5).exit_code == 0
    assert sum(1 for _ in FrameSet.open(out).frames()) == 5
    process = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.cli", *arguments(out, 40)], stderr=subprocess.DEVNULL
    )
    while not (out / "pictures" / "00001").exists():
        assert process.poll() is None, "it ended before it could be killed"
        time.sleep(0.01)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    assert draw(out, 40).exit_code == 0
    assert files(out) == files(drawn)


def test_another_seed_in_the_same_directory_is_refused(drawn: Path) -> None:
    before = files(drawn)
    result = draw(drawn, 40, "--seed", "1")
    assert result.exit_code == 2
    assert "its seed is 0, this one's 1" in result.output
    assert files(drawn) == before


def test_the_rooms_of_a_file_of_tasks_are_drawn_in_the_same_way(
    drawn: Path, tmp_path: Path
) -> None:
    file, out = tmp_path / "tasks.jsonl", tmp_path / "of-file"
    write_tasks(file, SUITE.tasks)
    options = ["--frames", "40", "--out", str(out), "--workers", "1", "--scenes", ROOMS, *SIZE]
    result = CliRunner().invoke(cli, ["data", "frames", "--tasks-file", str(file), *options])
    assert result.exit_code == 0, result.output
    assert files(out) == files(drawn)
    assert FrameSet.open(out).manifest.suite == "tasks"
    both = draw(tmp_path / "both", 1, "--tasks-file", str(file))
    assert both.exit_code == 2
    assert "give --suite or --tasks-file, not both" in both.output


def test_poses_and_states_are_of_many_kinds(drawn: Path) -> None:
    frames = list(FrameSet.open(drawn).frames())
    assert {each.horizon for each in frames} >= {0.0, 30.0}
    assert len({(each.x, each.z, each.rotation) for each in frames}) > len(frames) / 2
    seen = [each for frame in frames for each in frame.view]
    assert {each.open for each in seen} == {each.toggled for each in seen} == {None, True, False}
    around = next(each for each in frames if each.views)
    assert [each.direction for each in around.pictures] == ["ahead", "right", "behind", "left"]
    for frame in frames:
        assert not {*frame.absent} & {each.type for each in frame.view}


def test_a_frame_is_what_an_agent_sees_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(frame_camera._Tour, "_change", lambda self, now: None)
    task = next(each for each in load_suite("train").tasks if each.arrangement.poses)
    env = EmbodiedEnv((), obs_mode="rgb+objects", width=96, height=54)
    settings = {"backend": "embedded", **SUITE.env, "width": 96, "height": 54}
    camera = frame_camera.Camera(tmp_path, settings, "jpeg", 80, 0)
    photographer = frame_camera._Photographer(camera)
    room = frame_camera.Room(task.scene, task.arrangement)
    first = photographer(frame_camera.Visit(0, room))[0]
    photographer.close()
    obs, told = env.reset(options={"task": task})
    info = with_details(env, told)
    env.close()
    picture = (tmp_path / first.pictures[0].path).read_bytes()
    assert picture == encode_picture(obs["rgb"], quality=80)
    assert first.view == [SeenObject.of(each) for each in info["object_views"]]
    assert first.interactable == list(info["interactable"])
    assert {*first.navigable} <= {*info["navigable"]}


FRAME = Frame(
    id="00000-00",
    scene="FloorPlan5",
    x=0,
    z=0,
    rotation=90,
    horizon=0,
    pictures=[
        PictureRecord(path=f"{each}.jpeg", direction=each, width=96, height=54)
        for each in ("ahead", "right", "behind", "left")
    ],
    view=[
        SeenObject(type="CounterTop", side="ahead", distance=1),
        SeenObject(type="Toaster", side="left", distance=2, on="CounterTop", toggled=False),
    ],
    views={"right": [SeenObject(type="Fridge", side="left", distance=3, open=False)]},
    navigable=["CounterTop", "Fridge"],
    interactable=["CounterTop"],
    absent=["Apple", "Fridge", "Mug"],
)
ANSWERS = {
    "where CounterTop": "CounterTop; ahead",
    "where Toaster": "CounterTop ( Toaster far off ); left",
    "where Fridge": "Fridge unseen",
    "where Apple": "Apple unseen",
    "where Mug": "Mug unseen",
}


def test_the_answers_are_true_and_in_the_words_of_the_scene() -> None:
    asked, beginnings = set(), set()
    for number in range(20):
        chat = frame_chat(load_dialect("sight"), FRAME.model_copy(update={"id": str(number)}))
        texts = [turn.text for turn in chat.turns]
        assert [each.path for each in chat.pictures] == [
            f"{each}.jpeg" for each in ("ahead", "right", "behind", "left")
        ]
        assert all(chat.train)
        *pairs, last = zip(texts[::2], texts[1::2], strict=True)
        assert last == (
            "<image><image><image>",
            "<Observation>around Fridge closed</Observation>",
        )
        beginnings.add(texts[0].removeprefix("<image>").strip())
        scene = "<Observation>see CounterTop ( Toaster far off )</Observation>"
        for question, answer in pairs:
            question = question.removeprefix("<image>").strip()
            asked.add(question)
            assert answer == ANSWERS.get(question, scene)
    assert asked == {*ANSWERS, "", "see"}
    assert "" in beginnings
    assert len(beginnings) > 2
    with pytest.raises(ValueError, match="'tags' has no words for frames; choose sight"):
        frame_chat(load_dialect("tags"), FRAME)


@pytest.mark.parametrize("change", [{"frames": None}, {"scene": None}, {"scene_by": "user"}])
def test_frames_need_words_for_pictures(change: dict[str, Any]) -> None:
    sight = load_dialect("sight")
    words, scene = words_for_frames(sight, "en")
    assert (words.where, scene.view) == ("where {thing}", "see {things}")
    texts = {"en": sight.texts["en"].model_copy(update=change)}
    with pytest.raises(ValueError, match="'sight' has no words for frames"):
        words_for_frames(replace(sight, texts=texts), "en")


def test_rooms_that_are_kept_for_evaluation_are_not_learnt_from(drawn: Path) -> None:
    sight = DataSettings(dialect="sight")
    found = open_samples([drawn], sight)
    assert len(found.chats) == 40
    assert found.sees == "pictures"
    assert found.prompts == {"dialect": "sight", "language": "en"}
    manifest = drawn / "frames.json"
    before = manifest.read_text()
    told = json.loads(before)
    told["settings"]["scenes"].append("FloorPlan403")
    manifest.write_text(json.dumps(told))
    try:
        with pytest.raises(ValueError, match="kept for evaluation, such as FloorPlan403; learn"):
            open_samples([drawn], sight)
    finally:
        manifest.write_text(before)
