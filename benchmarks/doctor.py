"""What works on this machine, and what would mend the rest: one finding a line."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from er_gym.thor import SCENE_NAMES, make_controller, thor_executable
from er_gym.thor.player import Release, vulkan_is_there

EXTRAS = {
    "rl": ("sb3-contrib", "stable-baselines3", "tensorboard", "torch", "tqdm"),
    "trl": ("torch", "transformers", "trl"),
    "vlm": ("diskcache", "jinja2", "openai", "rapidfuzz"),
    "local": ("accelerate", "peft", "torch", "transformers"),
    "match": ("sentence-transformers",),
}
"""Extra to the packages that it brings, as in pyproject.toml; a test compares."""


@dataclass(frozen=True)
class Finding:
    """How one part does.

    Attributes:
        what: the part.
        works: whether it can be used as it is.
        says: what was found.
        mend: what would make it work; empty where it does.
        needed: er-gym does nothing without it.
    """

    what: str
    works: bool
    says: str
    mend: str = ""
    needed: bool = False


def examine() -> list[Finding]:
    """Look at every part, in the order in which they matter."""
    return [*_engine(), _player(), _unity(), _gpu(), *_extras()]


def _engine() -> Iterator[Finding]:
    start = time.perf_counter()
    try:
        controller = make_controller(scene=SCENE_NAMES[0], width=300, height=300)
    except Exception as error:  # whatever it is, this is the command that has to say so
        yield Finding("embedded engine", False, _words(error), _REINSTALL, needed=True)
        return
    took = time.perf_counter() - start
    objects = len(controller.last_event.metadata["objects"])
    says = f"{len(SCENE_NAMES)} scenes; {SCENE_NAMES[0]}, {objects} objects, ready in {took:.1f} s"
    yield Finding("embedded engine", True, says, needed=True)
    yield _attempt("renderer", lambda: _frame(controller), needed=True)
    controller.stop()


_REINSTALL = "install er-gym again"


def _frame(controller: Any) -> str:
    start = time.perf_counter()
    frame = controller.step("RotateRight", degrees=10).frame
    took = time.perf_counter() - start
    if frame.min() == frame.max():
        raise RuntimeError("the picture is of one colour")
    height, width = frame.shape[:2]
    return f"{width}×{height} in {1000 * took:.0f} ms, on the CPU"


def _player() -> Finding:
    return _attempt("player", _launched)


def _launched() -> str:
    program = thor_executable()
    done = subprocess.run(shlex.split(program), capture_output=True, text=True, timeout=60)
    if done.returncode != 2:  # it says who is to start it
        raise RuntimeError(f"{program} ended with {done.returncode}: {done.stderr.strip()}")
    release = Release()
    return program + (f"; installed as {release.platform}" if release.is_ours else "")


def _unity() -> Finding:
    """Whether AI2-THOR's own build is here, and can be started."""
    cloud, desktop = Release("CloudRendering"), Release("Linux64")
    display, vulkan = "DISPLAY" in os.environ, vulkan_is_there()
    found = [
        f"{name} {'found' if there else 'missing'}"
        for name, there in (
            ("build", cloud.is_unity or desktop.is_unity),
            ("Vulkan", vulkan),
            ("display", display),
        )
    ]
    works = (cloud.is_unity and vulkan) or (desktop.is_unity and display)
    mends = []
    if not (cloud.is_unity or desktop.is_unity):
        mends.append("AI2-THOR's client downloads the build at first use, from the network")
    if cloud.is_ours:
        mends.append("er-gym's player is in its place: er-gym player uninstall")
    if not vulkan and not display:
        mends.append("apt install libvulkan1 with a GPU's driver, or start an X server with GLX")
    return Finding("Unity build", works, ", ".join(found), "; ".join(mends) if not works else "")


def _gpu() -> Finding:
    program = shutil.which("nvidia-smi")
    if program is None:
        return Finding("GPU", False, "no NVIDIA driver", "only learning and local models want one")
    return _attempt("GPU", lambda: _names_of_gpus(program))


def _names_of_gpus(program: str) -> str:
    query = [program, "--query-gpu=name,memory.total", "--format=csv,noheader"]
    done = subprocess.run(query, capture_output=True, text=True, timeout=20, check=True)
    if not done.stdout.strip():
        raise RuntimeError("nvidia-smi lists none")
    return "; ".join(done.stdout.strip().splitlines())


def _extras() -> Iterator[Finding]:
    for extra, packages in EXTRAS.items():
        there = {package: _version(package) for package in packages}
        missing = [package for package, found in there.items() if found is None]
        says = ", ".join(f"{package} {found or 'missing'}" for package, found in there.items())
        mend = f"pip install 'er-gym[{extra}]'" if missing else ""
        yield Finding(f"extra {extra}", not missing, says, mend)


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _attempt(what: str, act: Callable[[], str], *, needed: bool = False) -> Finding:
    try:
        return Finding(what, True, act(), needed=needed)
    except Exception as error:  # as above
        return Finding(what, False, _words(error), _REINSTALL if needed else "", needed)


def _words(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
