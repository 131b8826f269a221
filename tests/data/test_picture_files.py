"""Pictures of strangers: only the formats that are meant, and a bound on pixels before decoding."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from support import ROOT

from benchmarks.checks.foreign_values import DDS, EPS, png
from er_gym.data.pictures import (
    FORMATS,
    MOST_PIXELS,
    UnusablePicture,
    check_picture,
    difference,
    open_picture,
    picture_size,
)


@pytest.mark.parametrize("form", FORMATS)
def test_the_formats_that_are_meant_are_read(form: str, tmp_path: Path) -> None:
    Image.new("RGB", (32, 18), "red").save(tmp_path / "a", form)
    assert picture_size(tmp_path / "a") == (32, 18)
    assert open_picture(tmp_path / "a").mode == "RGB"
    assert open_picture((tmp_path / "a").read_bytes()).size == (32, 18)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (EPS, "no picture of a format that er-gym reads: JPEG, PNG"),
        (DDS, "no picture of a format that er-gym reads"),
        (b"", "no picture of a format that er-gym reads"),
        (b"<svg xmlns='http://www.w3.org/2000/svg'/>", "no picture of a format"),
        (
            png(13_000, 13_000),
            "a picture of 13,000 × 13,000 = 169,000,000 pixels; er-gym reads at ",
        ),
        (png(60_000, 60_000), "a picture of 3,600,000,000 pixels; er-gym reads at most 67,108,864"),
    ],
    ids=["eps", "dds", "empty", "svg", "large", "bomb"],
)
@pytest.mark.filterwarnings("error")
def test_others_and_too_large_ones_are_refused_before_they_are_decoded(
    content: bytes, words: str, tmp_path: Path
) -> None:
    file = tmp_path / "a.png"
    file.write_bytes(content)
    for read in (picture_size, open_picture):
        with pytest.raises(UnusablePicture, match=r"\A[^\n]+\Z") as error:
            read(file)
        assert str(error.value).startswith(f"{file}: ")
        assert words in str(error.value)
        assert len(str(error.value)) < 300


def test_the_bound_itself_is_read() -> None:
    side = int(MOST_PIXELS**0.5)
    assert picture_size(png(side, side)) == (side, side)
    with pytest.raises(UnusablePicture, match=f"at most {MOST_PIXELS:,}; make it smaller"):
        picture_size(png(side + 1, side))


def test_what_is_no_regular_file_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.png")
    (tmp_path / "zero.png").symlink_to("/dev/zero")
    for name, words in (("pipe.png", "a pipe"), ("zero.png", "a device"), ("none.png", "no such")):
        with pytest.raises(UnusablePicture, match=words):
            open_picture(tmp_path / name)


def test_damage_is_told_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "a.png"
    Image.effect_noise((64, 64), 90).convert("RGB").save(file)
    whole = file.read_bytes()
    for cut in range(8, len(whole) - 20, len(whole) // 40):
        file.write_bytes(whole[:cut])
        with pytest.raises(UnusablePicture, match=r"\A[^\n]+\Z"):
            open_picture(file)
    assert difference(whole[:200], np.zeros((64, 64, 3), np.uint8)) == "is no whole picture"


@pytest.mark.parametrize("form", ["JPEG", "PNG", "WEBP"])
def test_an_end_that_is_missing_is_noticed(form: str, tmp_path: Path) -> None:
    file = tmp_path / "a"
    Image.effect_noise((64, 64), 90).convert("RGB").save(file, form)
    check_picture(file)
    file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    with pytest.raises(UnusablePicture, match=r"a damaged picture: \w"):
        check_picture(file)


def test_sixteen_bits_of_grey_are_refused(tmp_path: Path) -> None:
    """Pillow would make all but 256 of the 65,536 greys white."""
    Image.fromarray(np.arange(1 << 16, dtype=np.uint16).reshape(256, 256)).save(tmp_path / "a.png")
    for read in (picture_size, open_picture, check_picture):
        with pytest.raises(UnusablePicture, match="16-bit grey; er-gym reads 8 bits a channel"):
            read(tmp_path / "a.png")


def test_every_picture_is_opened_in_one_place() -> None:
    """Image.open anywhere else would take whatever Pillow can read."""
    found = {
        str(path.relative_to(ROOT))
        for package in ("er_gym", "agents", "benchmarks")
        for path in (ROOT / package).rglob("*.py")
        if "Image.open(" in path.read_text(encoding="utf-8")
    }
    assert found == {"er_gym/data/pictures.py"}
