"""Pictures as they are sent: their size, and their bytes."""

from __future__ import annotations

from io import BytesIO
from types import ModuleType

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from agents.vlm.pictures import FACTOR, encode, fitted
from agents.vlm.settings import Pictures

SIZES = [
    (width, height)
    for width in (1, 5, 27, 28, 42, 70, 299, 300, 640, 799, 800, 1024, 4000)
    for height in (1, 14, 28, 55, 56, 100, 300, 450, 451, 1080, 3000)
    if max(width, height) <= 200 * min(width, height)
]
BOUNDS = [(3_136, 351_232), (784, 784), (100_000, 200_000), (1, 40_000_000)]


def room(width: int = 300, height: int = 300) -> NDArray[np.uint8]:
    """A picture with gradients and edges, as a room has; (height, width, 3)."""
    y, x = np.mgrid[:height, :width]
    channels = (x * 255 // width, y * 255 // height, 255 * ((x // 20 + y // 20) % 2))
    return np.stack(channels, axis=-1).astype(np.uint8)


def decoded(data: bytes) -> NDArray[np.uint8]:
    return np.asarray(Image.open(BytesIO(data)).convert("RGB"))


@pytest.mark.parametrize(
    ("size", "sent"),
    [
        ((300, 300), (300, 300)),  # within the bounds: as it is
        ((640, 360), (640, 360)),
        ((56, 56), (56, 56)),  # 3,136 pixels, the fewest
        ((784, 448), (784, 448)),  # 351,232 pixels, the most
        ((800, 450), (784, 420)),  # 360,000 pixels
        ((450, 800), (420, 784)),
        ((1920, 1080), (784, 420)),
        ((56, 55), (56, 56)),  # too few, but not once its sides are rounded
        ((785, 448), (784, 448)),  # likewise, too many
        ((20, 20), (56, 56)),
        ((10, 100), (28, 112)),
    ],
)
def test_the_size_that_is_sent(size: tuple[int, int], sent: tuple[int, int]) -> None:
    assert fitted(*size, Pictures()) == sent


@pytest.mark.parametrize("bounds", BOUNDS)
def test_what_is_scaled_is_scaled_once(bounds: tuple[int, int]) -> None:
    settings = Pictures(min_pixels=bounds[0], max_pixels=bounds[1])
    for size in SIZES:
        width, height = fitted(*size, settings)
        if (width, height) == size:
            assert bounds[0] <= width * height <= bounds[1]
            continue
        assert (width % FACTOR, height % FACTOR) == (0, 0)
        assert min(width, height) >= FACTOR
        if min(width, height) > FACTOR:  # else a side could not be as short as it should
            assert bounds[0] <= 4 * width * height
            assert width * height <= bounds[1]
            assert 1 / 2 < (width / height) / (size[0] / size[1]) < 2


@pytest.mark.parametrize("bounds", BOUNDS)
def test_sizes_are_those_of_qwen(bounds: tuple[int, int], qwen_vl_utils: ModuleType) -> None:
    """Where they are scaled; Qwen's processor itself rounds the others."""
    settings = Pictures(min_pixels=bounds[0], max_pixels=bounds[1])
    compared = 0
    for width, height in SIZES:
        if bounds[0] <= width * height <= bounds[1]:
            continue
        theirs = qwen_vl_utils.smart_resize(height, width, FACTOR, *bounds)[::-1]
        if min(theirs) > 0:
            assert fitted(width, height, settings) == theirs
            compared += 1
    assert compared or bounds == BOUNDS[-1]


@pytest.mark.parametrize("size", [(0, 100), (100, 0), (201, 1), (10, 2010)])
def test_what_no_model_is_shown(size: tuple[int, int]) -> None:
    with pytest.raises(ValueError, match=f"a picture of {size[0]} x {size[1]} pixels cannot be"):
        fitted(*size, Pictures())


def test_a_jpeg_is_much_like_the_picture() -> None:
    rgb = room()
    picture = encode(rgb, Pictures(quality=95))
    assert (picture.media_type, picture.width, picture.height) == ("image/jpeg", 300, 300)
    assert picture.data.startswith(b"\xff\xd8\xff")
    assert np.abs(decoded(picture.data).astype(int) - rgb).mean() < 8


def test_a_png_is_the_picture() -> None:
    rgb = room(40, 100)
    picture = encode(rgb, Pictures(format="png"))
    assert (picture.media_type, picture.width, picture.height) == ("image/png", 40, 100)
    assert np.array_equal(decoded(picture.data), rgb)


@pytest.mark.parametrize("file_format", ["jpeg", "png"])
def test_a_large_picture_is_scaled(file_format: str) -> None:
    picture = encode(room(800, 450), Pictures.model_validate({"format": file_format}))
    assert (picture.width, picture.height) == (784, 420)
    shown = decoded(picture.data)
    assert shown.shape == (420, 784, 3)
    assert np.abs(shown[..., :2].astype(int) - room(784, 420)[..., :2]).mean() < 8


@pytest.mark.parametrize("file_format", ["jpeg", "png"])
@pytest.mark.parametrize("size", [(300, 300), (800, 450)])
def test_the_same_picture_is_the_same_bytes(size: tuple[int, int], file_format: str) -> None:
    settings = Pictures.model_validate({"format": file_format})
    rgb = room(*size)
    turned = np.asfortranarray(rgb)  # the same in another layout of memory
    pictures = {encode(each, settings).data for each in (rgb, rgb.copy(), turned)}
    assert len(pictures) == 1
    changed = rgb.copy()
    changed[100:140, 100:140] = 0
    assert encode(changed, settings).data not in pictures


def test_quality_is_jpegs_alone() -> None:
    rgb = room()
    sizes = [len(encode(rgb, Pictures(quality=quality)).data) for quality in (20, 60, 95)]
    assert sizes == sorted(set(sizes))
    assert (
        encode(rgb, Pictures(format="png", quality=20)).data
        == encode(rgb, Pictures(format="png", quality=90)).data
    )


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((30, 40), np.uint8),
        np.zeros((30, 40, 4), np.uint8),
        np.zeros((30, 40, 3), np.float32),
    ],
)
def test_what_is_no_picture(array: NDArray[np.uint8]) -> None:
    with pytest.raises(ValueError, match=r"a picture is \(height, width, 3\) of uint8, not \(30"):
        encode(array, Pictures())
