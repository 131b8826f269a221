"""Fixtures: a server for the tests, tiny models, and the package of Qwen for pictures."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it

from naughty_server import NaughtyServer

if TYPE_CHECKING:
    from local_clients import Clients, Models

    from agents.vlm.clients.local import LocalClient


@pytest.fixture
def naughty() -> Iterator[NaughtyServer]:
    """A server that behaves, until it is told otherwise with ``then``."""
    with NaughtyServer() as server:
        yield server


@pytest.fixture(scope="session")
def models(tmp_path_factory: pytest.TempPathFactory) -> Models:
    """The directory of a family's tiny model; needs the extra local."""
    from tiny_qwen import make_tiny_qwen

    made: dict[str, Path] = {}

    def directory(family: str) -> Path:
        if family not in made:
            made[family] = make_tiny_qwen(tmp_path_factory.mktemp(family), family=family)
        return made[family]

    return directory


@pytest.fixture
def client(models: Models) -> Iterator[Clients]:
    """Makes clients of tiny models, and closes them; needs the extra local."""
    from local_clients import settings

    from agents.vlm.clients.local import LocalClient

    made: list[LocalClient] = []

    def make(family: str | Path = "qwen2_5_vl", /, **changes: Any) -> LocalClient:
        path = models(family) if isinstance(family, str) else family
        made.append(LocalClient(str(path), settings(family, **changes)))
        return made[-1]

    yield make
    for each in made:
        each.close()


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
