"""A collection that was played once for all tests of the exports."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.append(str(Path(__file__).parent))  # for the helpers beside it
sys.path.append(str(Path(__file__).parents[2] / "agents" / "vlm"))  # for tiny_qwen

from played_collection import make_collection

from er_gym.data.collection import Collection


@pytest.fixture(scope="session")
def collection(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    folder = tmp_path_factory.mktemp("collection") / "played"
    return make_collection(folder, parts=["mixed"], width=128, height=72)
