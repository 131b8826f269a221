"""``er-gym data``."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from played_collection import make_collection

from benchmarks.cli import main as cli
from er_gym.data.collection import Collection
from er_gym.data.trajectory import Trajectory

ErGym = Callable[..., tuple[Any, str, str]]
SOAP = "FloorPlan14-single_search-SoapBottle~a"


@pytest.fixture
def er_gym(capsys: pytest.CaptureFixture[str]) -> ErGym:
    """Runs the command in this process; returns exit code, stdout and stderr."""

    def run(*arguments: object) -> tuple[Any, str, str]:
        with pytest.raises(SystemExit) as left:
            cli.main([str(argument) for argument in arguments])
        out, err = capsys.readouterr()
        return left.value.code, out, err

    return run


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_collection(tmp_path_factory.mktemp("data") / "x").path


def test_verify(er_gym: ErGym, path: Path, tmp_path: Path) -> None:
    code, out, err = er_gym("data", "verify", path, "--workers", 1)
    assert code == 0
    assert "7 of 7 trajectories come out as they were recorded" in out
    assert "er-gym:" not in err
    copy = Collection.open(shutil.copytree(path, tmp_path / "y"))
    every = []
    for one in copy.trajectories():
        told = one.model_dump()
        told["success"] = False
        for turn in told["turns"]:
            turn["feedback"] = "Yes."
        every += [Trajectory.model_validate({**told, "id": f"{one.id}-{n}"}) for n in range(3)]
    copy.write(every)
    code, out, err = er_gym("data", "verify", copy.path, "--no-pictures", "--workers", 1)
    assert code == 1
    assert "0 of 21 trajectories" in out
    assert "Pictures were not compared" in out
    lines = [line for line in err.splitlines() if line.startswith("er-gym: ")]
    assert len(lines) == 22
    assert lines[-2].endswith(" more")
    assert lines[-1].startswith("er-gym: do not train on these trajectories; to make them anew")
    assert "feedback is 'Done" in err


def test_stats(er_gym: ErGym, path: Path, tmp_path: Path) -> None:
    code, table, _ = er_gym("data", "stats", path)
    assert code == 0
    assert "the paper's set 1" in table
    code, out, _ = er_gym("data", "stats", path, "--format", "json")
    assert (code, json.loads(out)["task_types"]["pickup_and_put"]) == (0, 2)
    plots = tmp_path / "plots"
    code, out, err = er_gym("data", "stats", path, "--format", "md", "--plots", plots)
    assert (code, out.count("**mini: ")) == (0, 8)
    names = sorted(file.name for file in plots.glob("*.png"))
    assert names == ["actions.png", "kinds.png", "transitions.png"]
    assert len(err.splitlines()) == 3
    for file in plots.glob("*.png"):
        with Image.open(file) as picture:
            assert picture.convert("RGB").getpixel((2, 2)) == (255, 255, 255)
            assert len(picture.convert("RGB").getcolors(1 << 20) or ()) > 20


def test_show(er_gym: ErGym, path: Path, tmp_path: Path) -> None:
    code, out, _ = er_gym("data", "show", path)
    lines = (path / "trajectories.jsonl").read_text(encoding="utf-8").splitlines()
    assert (code, out.splitlines()) == (0, [json.loads(line)["id"] for line in lines])
    assert SOAP in out
    assert er_gym("data", "show", path, "--out", tmp_path / "x.png")[0] == 2
    code, out, _ = er_gym("data", "show", path, "--trajectory", SOAP)
    assert code == 0
    assert "Turn 0, search (ahead)" in out
    assert "planning: My plan is to navigate to" in out
    assert out.rstrip().endswith("The task is done (end).")
    strip = tmp_path / "strip.png"
    code, out, _ = er_gym("data", "show", path, "--trajectory", SOAP, "--out", strip)
    assert (code, out) == (0, f"{strip}\n")
    with Image.open(strip) as picture:
        assert picture.width > 1000
    strip.write_text("somebody's")
    code, _, err = er_gym("data", "show", path, "--trajectory", SOAP, "--out", strip)
    assert code == 2
    assert "er-gym did not write it" in err


def empty(path: Path) -> None:
    Collection.open(path).write(())


def other_suite(path: Path) -> None:
    told = json.loads((path / "collection.json").read_text())
    (path / "collection.json").write_text(json.dumps({**told, "suite": "my-tasks"}))


def other_digest(path: Path) -> None:
    told = json.loads((path / "collection.json").read_text())
    (path / "collection.json").write_text(json.dumps({**told, "suite_digest": "0"}))


def damaged_part(path: Path) -> None:
    (path / "parts/imitation/run.json").write_text("{")


def unwritten(path: Path) -> None:
    (path / "trajectories.jsonl").unlink()


def cut(path: Path) -> None:
    with (path / "trajectories.jsonl").open("a") as file:
        file.write('{"format": "er-g')


def twice(path: Path) -> None:
    file = path / "trajectories.jsonl"
    file.write_text(file.read_text() * 2)


def pipe(path: Path) -> None:
    unwritten(path)
    os.mkfifo(path / "trajectories.jsonl")


def as_it_is(path: Path) -> None:
    pass


BAD = {
    "no collection": (("stats", "."), as_it_is, "is no collection: "),
    "nothing there": (("verify", "none"), as_it_is, "is no collection: "),
    "empty": (("stats", "x"), empty, "x holds no trajectory yet"),
    "empty to show": (("show", "x", "--trajectory", "a"), empty, "x holds no trajectory yet"),
    "empty to verify": (("verify", "x"), empty, "x holds no trajectory yet"),
    "unknown": (
        ("show", "x", "--trajectory", "FloorPlan14-SoapBottle"),
        as_it_is,
        f"no trajectory 'FloorPlan14-SoapBottle' among the 7 in x; close to it are: {SOAP}",
    ),
    "no kind of picture": (
        ("show", "x", "--trajectory", SOAP, "--out", "a.txt"),
        as_it_is,
        "'.txt' is not a picture format",
    ),
    "no folder": (
        ("show", "x", "--trajectory", SOAP, "--out", "no/a.png"),
        as_it_is,
        "there is no folder",
    ),
    "tasks of a file": (("verify", "x"), other_suite, "give them with --tasks-file or --suite"),
    "both": (
        ("verify", "x", "--suite", "mini", "--tasks-file", "x/collection.json"),
        as_it_is,
        "give --suite or --tasks-file, not both",
    ),
    "another suite": (
        ("verify", "x", "--suite", "er-1k"),
        as_it_is,
        "the tasks of 'er-1k' are not those that x was played in",
    ),
    "twice": (("stats", "x"), twice, f"trajectories.jsonl:8: the trajectory '{SOAP}' is there tw"),
    "a pipe": (("stats", "x"), pipe, "cannot be read (not a regular file)"),
    "a pipe to verify": (("verify", "x"), pipe, "cannot be read (not a regular file)"),
    "other tasks": (("verify", "x"), other_digest, "are not those that x was played in"),
    "damaged part": (("verify", "x"), damaged_part, "is no run: "),
    "unwritten": (("stats", "x"), unwritten, "trajectories.jsonl cannot be read"),
    "cut": (("stats", "x"), cut, "trajectories.jsonl:8: "),
    "cut to verify": (("verify", "x"), cut, "trajectories.jsonl:8: "),
    "format": (("stats", "x", "--format", "xml"), as_it_is, "--format"),
    "limit": (("verify", "x", "--limit", "0"), as_it_is, "--limit"),
}


@pytest.mark.parametrize(("words", "damage", "message"), BAD.values(), ids=BAD)
def test_bad_input_ends_in_one_line(
    er_gym: ErGym,
    path: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
    damage: Callable[[Path], None],
    message: str,
) -> None:
    shutil.copytree(path, tmp_path / "x")
    damage(tmp_path / "x")
    monkeypatch.chdir(tmp_path)
    code, out, err = er_gym("data", *words)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err
