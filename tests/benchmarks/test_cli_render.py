"""``er-gym render`` and ``er-gym play``: pictures in files, bad input in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from benchmarks.cli.main import cli, main


def picture(tmp_path: Path, *arguments: str) -> np.ndarray:
    file = tmp_path / "room.png"
    size = ("--width", "160", "--height", "120")
    result = CliRunner().invoke(cli, ["render", *arguments, *size, "--out", str(file)])
    assert result.exit_code == 0, result.output
    assert str(file) in result.output
    return np.asarray(Image.open(file))


def test_each_sort_of_picture(tmp_path: Path) -> None:
    pose = ("--scene", "FloorPlan1", "--pose=-0.5,1.5,150,10")
    rgb = picture(tmp_path, *pose)
    assert rgb.shape == (120, 160, 3)
    named = picture(tmp_path, *pose, "--annotate")
    assert named.shape == rgb.shape
    assert 0.01 < (named != rgb).any(axis=2).mean() < 0.9
    depth = picture(tmp_path, *pose, "--what", "depth")
    assert depth.shape == (120, 160)
    assert 300 < depth.min() < depth.max() < 10_000  # millimetres
    ids = picture(tmp_path, *pose, "--what", "ids")
    assert len(np.unique(ids.reshape(-1, 3), axis=0)) > 8
    plan = picture(tmp_path, "--scene", "FloorPlan1", "--what", "map")
    assert plan.std() > 30


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scene", "FloorPlan20399"], "FloorPlan1-30"),
        (["--scene", "FloorPlan1", "--pose", "here"], "such as 1.0,-0.5,90"),
        (["--scene", "FloorPlan1", "--pose", "50,50,0"], "GetReachablePositions"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["render", *arguments, "--out", str(tmp_path / "x.png")])
    assert ended.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
    assert not (tmp_path / "x.png").exists()


def test_a_person_plays_and_the_frames_are_kept(tmp_path: Path) -> None:
    frames = tmp_path / "frames"
    result = CliRunner().invoke(
        cli,
        ["play", "--scene", "FloorPlan1", "--no-window", "--frames", str(frames)],
        input="observe\nfly to the moon\nend\n",
    )
    assert result.exit_code == 0, result.output
    assert "Task:" in result.output
    assert "names no action" in result.output
    assert "not solved (end)" in result.output
    assert sorted(file.name for file in frames.iterdir()) == [
        "000.png",
        "001.png",
        "002.png",
        "003.png",
    ]
    assert np.asarray(Image.open(frames / "000.png")).shape == (450, 800, 3)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--task", "nope"), "no task with the id 'nope'; ids here are such as FloorPlan"),
        (
            ("--scene", "FloorPlan203"),
            "no task to play in FloorPlan203; the scenes of mini are such as",
        ),
    ],
)
def test_playing_what_is_not_there_is_one_line(
    options: tuple[str, str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["play", *options, "--no-window"])
    assert ended.value.code == 2
    assert told in capsys.readouterr().err


def test_pictures_of_others_are_replaced_with_force_only(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "000.png").write_bytes(b"mine")
    mine = str(tmp_path / "000.png")
    size = ("--width", "64", "--height", "64")
    play = ("play", "--scene", "FloorPlan401", "--no-window", "--frames", str(tmp_path))
    for command in (("render", "--scene", "FloorPlan401", "--out", mine, *size), play):
        Path(mine).write_bytes(b"mine")
        with pytest.raises(SystemExit) as ended:
            main([*command])
        error = capsys.readouterr().err
        assert (ended.value.code, error.count("\n")) == (2, 1)
        assert "er-gym did not write it" in error
        assert [file.name for file in tmp_path.iterdir()] == ["000.png"]
        assert Path(mine).read_bytes() == b"mine"
        result = CliRunner().invoke(cli, [*command, "--force"], input="quit\n")
        assert result.exit_code == 0, result.output
        assert Path(mine).read_bytes().startswith(b"\x89PNG")
