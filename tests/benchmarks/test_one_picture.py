"""The check that a picture depends only on the state, tried on one or two states."""

from __future__ import annotations

import re
from itertools import count
from typing import Any

import pytest
from click.testing import CliRunner

from benchmarks.checks import one_picture
from er_gym.sim.render.panda import Frames, Rasteriser


def test_states_look_the_same_however_they_are_reached() -> None:
    result = CliRunner().invoke(one_picture.main, ["--states", "2", "--processes", "1"])
    assert result.exit_code == 0, result.output
    counts = {what: int(n) for n, what in re.findall(r"^ *(\d+) (.+)$", result.output, re.M)}
    assert counts["pictures"] >= 48
    assert counts["pictures of fresh processes"] >= 16
    assert counts["differences in 2 states"] == 0


def test_a_pixel_that_depends_on_the_past_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    draw, drawn = Rasteriser.draw, count()

    def spoiled(self: Rasteriser, *arguments: Any, **named: Any) -> Frames:
        frames = draw(self, *arguments, **named)
        frames.rgb[7, 9, 0] = next(drawn) % 251
        return frames

    monkeypatch.setattr(Rasteriser, "draw", spoiled)
    result = CliRunner().invoke(one_picture.main, ["--states", "1", "--processes", "0"])
    assert result.exit_code == 1
    assert "after_another_room: 300x300 rgb: 1 pixels" in result.output
