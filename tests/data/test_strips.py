"""Strips: every picture and every word of a trajectory is drawn."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import ExifTags, Image, ImageColor, ImageFont
from played_collection import make_collection

from er_gym.data import fonts, strips
from er_gym.data.collection import Collection
from er_gym.data.fonts import NoFont, font_for
from er_gym.data.pictures import Encoding, difference, encode_picture
from er_gym.data.strips import COLOURS, draw_strip, wrap_text


@pytest.fixture(scope="module")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    return make_collection(tmp_path_factory.mktemp("data") / "x", parts=["anomalies"])


def test_a_strip_has_the_pictures_and_the_colours_of_the_kinds(collection: Collection) -> None:
    every = list(collection.trajectories())
    one = next(each for each in every if any(len(turn.pictures) == 3 for turn in each.turns))
    strip = draw_strip(one, collection.path)
    colours = {colour for _, colour in strip.getcolors(1 << 20) or ()}
    kinds = {thought.kind for turn in one.turns for thought in turn.thoughts}
    for kind, colour in COLOURS.items():
        assert (ImageColor.getrgb(colour) in colours) == (kind in kinds), kind
    pixels = np.asarray(strip)
    # The first picture stands where it should, as wide as its column.
    with Image.open(collection.path / one.turns[0].pictures[0].path) as first:
        scaled = first.convert("RGB").resize((420, 236), Image.Resampling.LANCZOS)
    tops = np.flatnonzero((pixels[:, 20:440] == np.asarray(scaled)[0]).all(axis=(1, 2)))
    assert len(tops)
    assert (pixels[tops[0] : tops[0] + 236, 20:440] == np.asarray(scaled)).all()
    # More words need more room.
    long = one.turns[0].thoughts[0].model_copy(update={"text": "I look at many things. " * 60})
    turns = [one.turns[0].model_copy(update={"thoughts": [long]}), *one.turns[1:]]
    assert (
        draw_strip(one.model_copy(update={"turns": turns}), collection.path).height > strip.height
    )


def test_a_strip_that_would_be_too_high_and_a_missing_picture(
    collection: Collection, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = next(collection.trajectories())
    monkeypatch.setattr(strips, "_MOST_HEIGHT", 900)
    with pytest.raises(ValueError, match=r"would be [\d,]+ pixels high, more than 900"):
        draw_strip(one, collection.path)
    with pytest.raises(ValueError, match=r"000\.jpeg: no such file"):
        draw_strip(one, collection.path / "elsewhere")


def test_lines_fit_and_lose_nothing() -> None:
    font = font_for("", 16)
    for text in (
        "I go to the fridge, since eggs are mostly kept there. " * 4,
        "x" * 300,
        "a " + "y" * 120 + " b",
        "我先看看四周前面有一个冰箱" * 10,
        "one\ntwo",
    ):
        lines = wrap_text(text, font, 200)
        assert all(font.getlength(line) <= 200 for line in lines)
        assert "".join("".join(lines).split()) == "".join(text.split())
    assert wrap_text("", font, 200) == [""]
    assert wrap_text("aa bb", font, 10_000) == ["aa bb"]


def test_letters_that_no_font_has_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    assert font_for("abc äöü “„ …", 16).size == 16
    monkeypatch.setattr(fonts, "_NAMES", ("DejaVuSans.ttf",))
    with pytest.raises(NoFont, match=r"no font of this system has all.*such as 前看") as caught:
        font_for("ab 看前", 16)
    assert "\n" not in str(caught.value)
    with pytest.raises(ValueError, match="is no TrueType or OpenType font"):
        font_for("a", 16, Path(__file__))
    dejavu = Path(ImageFont.truetype("DejaVuSans.ttf", 9).path)  # type: ignore[arg-type]
    assert font_for("ab", 16, dejavu).size == 16
    with pytest.raises(NoFont, match=r"DejaVuSans\.ttf lacks some"):
        font_for("看", 16, dejavu)


def test_a_picture_is_compared_by_its_pixels() -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (40, 60, 3), dtype=np.uint8)
    for form in ("jpeg", "png"):
        assert difference(encode_picture(rgb, form=form, quality=77), rgb) == ""
        assert difference(Encoding(form, 77).of(rgb), rgb, Encoding(form, 77)) == ""
    other = rgb.copy()
    other[0, 0] ^= 255
    assert difference(encode_picture(rgb, form="png"), other) == (
        f"differs in 1 of 2,400 pixels, by up to {abs(2 * rgb[0, 0].astype(int) - 255).max()}"
    )
    assert difference(b"", rgb) == "is no whole picture"


def test_a_picture_that_was_written_otherwise_is_told() -> None:
    rgb = np.random.default_rng(0).integers(0, 255, (40, 60, 3), dtype=np.uint8)
    written, turned = Encoding("jpeg", 80), io.BytesIO()
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = 3  # upside down
    Image.fromarray(rgb).save(turned, "jpeg", quality=80, exif=exif)
    small = encode_picture(rgb, (30, 20), quality=80)
    for data, why in (
        (turned.getvalue(), "EXIF data is {274: 3}, not none"),
        (small, "size is 30 x 20, not 60 x 40"),
        (encode_picture(rgb, quality=20), "table of quality is "),
        (encode_picture(rgb, form="png"), "form is PNG, not JPEG"),
    ):
        assert why in difference(data, rgb, written)
    assert "size is 30 x 20" in difference(small, rgb)
    assert "EXIF data" in difference(turned.getvalue(), rgb)
