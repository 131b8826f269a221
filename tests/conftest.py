"""What tests of every package share."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def repository() -> Path:
    """The root of the checkout."""
    return ROOT


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of data that is shared beside the checkout and is not part of it."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("needs the shared data, ../shared/data beside the checkout")
    return folder


@pytest.fixture(scope="session")
def scene_objects() -> Iterator[Callable[[str], list[dict[str, Any]]]]:
    """A function from a scene's name to the objects that its metadata lists at the start."""
    from er_gym.thor import make_controller

    controller = make_controller(scene="FloorPlan1")

    def objects(scene: str) -> list[dict[str, Any]]:
        metadata = controller.reset(scene).metadata
        found: list[dict[str, Any]] = metadata["objects"]
        return found

    yield objects
    controller.stop()
