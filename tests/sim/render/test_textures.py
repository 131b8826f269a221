from __future__ import annotations

import subprocess
import sys
from hashlib import blake2b

import numpy as np
import pytest

from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.pictures import PICTURES
from er_gym.sim.render.textures import SURFACES, TEXTURES, texture

ALL = sorted(TEXTURES)


def test_every_material_has_its_texture() -> None:
    assert {m.texture for m in MATERIALS.values() if m.texture is not None} <= set(TEXTURES)


def test_no_texture_is_both_tinted_and_coloured() -> None:
    assert not set(SURFACES) & set(PICTURES)


@pytest.mark.parametrize("name", ALL)
def test_textures_are_square_with_a_power_of_two_for_a_side(name: str) -> None:
    picture = texture(name)
    side = len(picture)
    assert picture.shape == (side, side, 3)
    assert picture.dtype == np.uint8
    assert side in (64, 128)


@pytest.mark.parametrize("name", sorted(SURFACES))
def test_what_is_multiplied_with_a_colour_leaves_it_bright(name: str) -> None:
    assert texture(name).mean() / 255 > 0.75
    assert texture(name).std() > 0


@pytest.mark.parametrize(
    "name", ["plaster", "wood", "carpet", "fabric", "stone", "marble", "metal", "bark", "leaves"]
)
def test_textures_that_repeat_have_no_seam(name: str) -> None:
    picture = texture(name).astype(float)
    for axis in (0, 1):
        steps = np.abs(np.diff(picture, axis=axis)).mean(axis=(1 - axis, 2))
        first, last = picture.take(0, axis), picture.take(-1, axis)
        assert np.abs(first - last).mean() <= 1.5 * steps.max()


def test_paintings_are_clearly_different() -> None:
    small = {k: texture(f"picture{k}").reshape(8, 16, 8, 16, 3).mean(axis=(1, 3)) for k in range(8)}
    for k in range(8):
        for other in range(k):
            assert np.abs(small[k] - small[other]).mean() > 30


def test_textures_are_the_same_in_every_process() -> None:
    code = (
        "from er_gym.sim.render.textures import TEXTURES, texture; from hashlib import blake2b;"
        "print(blake2b(b''.join(texture(n).tobytes() for n in sorted(TEXTURES))).hexdigest())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    here = blake2b(b"".join(texture(name).tobytes() for name in ALL)).hexdigest()
    assert done.stdout.strip() == here
