"""Videos of episodes: a frame for each step, with what it shows, thinks and does."""

from __future__ import annotations

import importlib.util
import io
import json
from pathlib import Path

import pytest
from PIL import Image

from benchmarks.cli import main as cli
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.video import film
from benchmarks.monitor.world import Worlds
from er_gym.rollout.run_directory import RunDirectory


def video(*arguments: object) -> int:
    with pytest.raises(SystemExit) as left:
        cli.main(["ui", "--video", *map(str, arguments)])
    return int(left.value.code or 0)


def test_an_episode_becomes_a_webp(runs, tmp_path, capsys):
    run = RunDirectory.open(runs / "oracle")
    episode = min(run.episodes(), key=lambda each: len(each.steps))
    out = tmp_path / "x.webp"
    assert video(runs / "oracle", "--episode", episode.key, "--out", out) == 0
    frames = len(episode.steps)  # those after the first, which placed the agent, and the end
    assert f"{frames} frames" in capsys.readouterr().out
    with Image.open(out) as picture:
        assert picture.format == "WEBP"
        assert picture.n_frames == frames
        shown = []
        for number in range(frames):
            picture.seek(number)
            page = picture.convert("RGB")
            shown.append(page.resize((32, 24)).tobytes())
            colours = page.crop((0, 0, page.width, 360)).resize((64, 36)).getcolors(4096) or ()
            assert len(colours) > 20  # a room was drawn
    assert len(set(shown)) > 1
    assert video(runs / "oracle", "--out", out) == 2  # it is there
    assert video(runs / "oracle", "--out", out, "--overwrite") == 0


def test_thoughts_make_a_frame_stay(runs, tmp_path):
    """The same episode with a long thought: its frame stays longer, and says more."""
    run = RunDirectory.open(runs / "oracle")
    key = next(run.episodes()).key
    worlds = Worlds()
    plain = film(run, key, worlds)
    record = run.episode(key)
    step = record.steps[1].model_copy(
        update={"thought": "I look for it. " * 8 + "接下来去看看。\u202e"}
    )
    other = RunDirectory.create(tmp_path / "other", run.manifest)
    other.write(record.model_copy(update={"steps": [record.steps[0], step, *record.steps[2:]]}))
    told = film(other, key, worlds)
    assert len(told) == len(plain)
    assert told[0].seconds > plain[0].seconds
    assert told[1].seconds == plain[1].seconds
    below = (0, 360, *plain[0].picture.size)
    assert _ink(told[0].picture.crop(below)) > 1.2 * _ink(plain[0].picture.crop(below))
    room = (0, 0, 640, 360)
    assert told[0].picture.crop(room).tobytes() == plain[0].picture.crop(room).tobytes()


def _ink(picture: Image.Image) -> int:
    return sum(picture.convert("L").histogram()[:128])


def test_the_page_offers_it(runs, visit):
    client = visit(runs)
    (directory,) = (each for each in Directories([runs]).all() if each.path.name == "oracle")
    key = next(RunDirectory.open(directory.path).episodes()).key
    page = client.get(f"/runs/{directory.id}/episode", params={"key": key})
    assert f'href="/runs/{directory.id}/video?key={key}"' in page.text
    answer = client.get(f"/runs/{directory.id}/video", params={"key": key})
    assert answer.headers["content-type"] == "image/webp"
    assert "attachment" in answer.headers["content-disposition"]
    with Image.open(io.BytesIO(answer.content)) as picture:
        assert picture.n_frames > 1
    assert client.get(f"/runs/{directory.id}/video", params={"key": "../x"}).status_code == 404


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--out", "x.gif"), ".webp or .mp4"),
        (("--out", "x.webp", "--episode", "none"), "'none'"),
        ((), "--out"),
    ],
)
def test_bad_options_are_one_line(arguments, told, runs, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert video(runs / "oracle", *arguments) == 2
    message = capsys.readouterr().err
    assert told in message
    assert message.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_an_mp4_needs_a_package_or_is_one(runs: Path, tmp_path: Path, capsys):
    out = tmp_path / "x.mp4"
    if importlib.util.find_spec("imageio_ffmpeg") is None:
        assert video(runs / "oracle", "--out", out) == 2
        assert "pip install imageio-ffmpeg" in capsys.readouterr().err
    else:
        assert video(runs / "oracle", "--out", out) == 0
        assert out.read_bytes()[4:8] == b"ftyp"


def test_another_engines_episodes_cannot_be_drawn(runs, tmp_path, capsys):
    run = RunDirectory.open(runs / "oracle")
    other = RunDirectory.create(
        tmp_path / "run", run.manifest.model_copy(update={"suite": "package:suite"})
    )
    other.write(next(run.episodes()))
    assert video(other.path, "--out", tmp_path / "x.webp") == 2
    assert "none of er-gym's own suites" in capsys.readouterr().err
    assert json.loads((other.path / "run.json").read_text())["suite"] == "package:suite"
