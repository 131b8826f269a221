"""What works on this machine, and what would mend the rest: one finding a line."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import er_gym
from benchmarks.cli.extras import claimants, extras, installed_version, state_of
from er_gym.thor import SCENE_NAMES, make_controller, thor_executable
from er_gym.thor.places import GpuMapping, Release


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
    return [
        *_engine(),
        _player(),
        *_programs(),
        _unity(),
        _gpu(),
        *_packages(),
        *_extras(),
    ]


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
    return program


_ASK_THE_CLIENT = """
import json, os
from ai2thor import platform
request = platform.Request("Linux", 300, 300, os.environ.get("DISPLAY"), False)
names = ("Linux64", "CloudRendering")
print(json.dumps({name: getattr(platform, name).validate(request) for name in names}))
"""
_MENDS = {
    "Linux64": "sudo apt install xvfb; xvfb-run -s '-screen 0 1280x1024x24' python PROGRAM",
    "CloudRendering": "sudo apt install libvulkan1 (no GPU is needed)",
}
"""Platform to what satisfies the client's test of the machine."""
_CLIENT = "5.0.0"
"""The version of ai2thor whose protocol the player speaks."""


def _programs() -> Iterator[Finding]:
    """Whether AI2-THOR programs get the player without saying so."""
    calls = {"Linux64": "Controller(scene=…)", "CloudRendering": "platform=CloudRendering"}
    try:
        missing = _missed_by_the_client()
    except (subprocess.SubprocessError, ValueError) as error:
        yield Finding(calls["Linux64"], False, _words(error), f"pip install ai2thor=={_CLIENT}")
        return
    for platform, call in calls.items():
        yield _program(call, Release(platform), missing[platform])
    if GpuMapping().is_ours:
        yield Finding("gpu_device=…", True, "any number will do")
    elif GpuMapping().path.exists():
        yield Finding("gpu_device=…", True, f"the numbers in {GpuMapping().path}")
    else:
        says = "the client asks vulkaninfo and nvidia-smi"
        yield Finding("gpu_device=…", False, says, "er-gym player install")


def _missed_by_the_client() -> dict[str, list[str]]:
    """Platform to what AI2-THOR's client misses on this machine, in a program as a user's."""
    program = [sys.executable, "-c", _ASK_THE_CLIENT]
    done = subprocess.run(program, capture_output=True, text=True, timeout=60, check=True)
    missing: dict[str, list[str]] = json.loads(done.stdout)
    return missing


def _program(call: str, release: Release, missing: list[str]) -> Finding:
    if release.is_unity:
        mend = "" if not missing else _MENDS[release.platform]
        return Finding(call, not missing, "starts Unity's build", mend)
    if not release.is_ours:
        return Finding(call, False, "no build is there", "er-gym player install")
    if missing:
        says = f"the player is installed, but AI2-THOR's client wants more: {missing[0]}"
        here = "er-gym player install in this Python, or in a virtual environment"
        mend = f"{here}; or {_MENDS[release.platform]}"
        return Finding(call, False, says, mend)
    return Finding(call, True, f"starts the player; {version_of_client()}")


def version_of_client() -> str:
    """The client that the player takes a build's place for, in words."""
    from ai2thor._builds import COMMIT_ID

    there = installed_version("ai2thor")
    known = "" if there == _CLIENT else f" (er-gym was written for {_CLIENT})"
    return f"ai2thor {there}{known}, commit_id {COMMIT_ID[:7]}"


def _unity() -> Finding:
    """Whether AI2-THOR's own build is here, and can be started."""
    cloud, desktop = Release("CloudRendering"), Release("Linux64")
    display, vulkan = "DISPLAY" in os.environ, find_library("vulkan") is not None
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
    if cloud.is_ours or desktop.is_ours:
        mends.append("er-gym's player is in its place: er-gym player uninstall")
    if not (cloud.is_unity or desktop.is_unity):
        mends.append("AI2-THOR's client downloads the build at first use, from the network")
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
    try:
        names = extras()
    except PackageNotFoundError:
        says = "er-gym is not installed in this Python, so its extras cannot be looked up"
        yield Finding("extras", False, says, "pip install --editable . in the checkout")
        return
    for name in names:
        state = state_of(name)
        if state.complete:
            yield Finding(f"extra {name}", True, ", ".join(state.packages))
            continue
        lacks = [*(f"{each} missing" for each in state.missing), *state.wrong]
        lacks += [f"this Python cannot have {each}" for each in state.unsupported]
        mend = f"pip install 'er-gym[{name}]'" if state.missing or state.wrong else ""
        yield Finding(f"extra {name}", False, ", ".join(lacks), mend)


def _packages() -> Iterator[Finding]:
    """Whether ``agents`` and ``benchmarks``, common names for packages, are ours here."""
    for name in ("agents", "benchmarks"):
        spec = find_spec(name)
        place = Path(spec.origin).parents[1] if spec is not None and spec.origin else None
        others = ", ".join(f"{each} {installed_version(each)}" for each in claimants(name))
        if place != _HOME:
            says = f"this name imports {place or 'no package'}, not er-gym's in {_HOME}"
            says += f"; {others} has it too" if others else ""
            yield Finding(f"package {name}", False, says, _APART, needed=True)
        elif others:
            says = f"{others} has a package of this name too: the one installed last overwrites"
            yield Finding(f"package {name}", False, says, _APART)
        else:
            yield Finding(f"package {name}", True, "er-gym's, and of no other distribution")


_HOME = Path(er_gym.__file__).parents[1]
_APART = "give er-gym a virtual environment of its own"


def _attempt(what: str, act: Callable[[], str], *, needed: bool = False) -> Finding:
    try:
        return Finding(what, True, act(), needed=needed)
    except Exception as error:  # as above
        return Finding(what, False, _words(error), _REINSTALL if needed else "", needed)


def _words(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
