"""Fixtures: a server for the tests, and Qwen's package for pictures."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it

from naughty_server import NaughtyServer


@pytest.fixture
def naughty() -> Iterator[NaughtyServer]:
    """A server that behaves, until it is told otherwise with ``then``."""
    with NaughtyServer() as server:
        yield server


@pytest.fixture(scope="session")
def qwen_vl_utils() -> ModuleType:
    """The package itself. It wants torchvision, of which it uses nothing for pictures; where that
    is not installed, an empty one will do."""
    if importlib.util.find_spec("qwen_vl_utils") is None:
        pytest.skip("needs qwen-vl-utils")
    with pytest.MonkeyPatch.context() as patch:
        if importlib.util.find_spec("torchvision") is None:
            empty = {
                name: ModuleType(name)
                for name in ("torchvision", "torchvision.io", "torchvision.transforms")
            }
            empty["torchvision"].io = empty["torchvision.io"]  # type: ignore[attr-defined]
            empty["torchvision"].transforms = empty["torchvision.transforms"]  # type: ignore[attr-defined]
            empty["torchvision.transforms"].InterpolationMode = None  # type: ignore[attr-defined]
            for name, module in empty.items():
                patch.setitem(sys.modules, name, module)
        return importlib.import_module("qwen_vl_utils")
