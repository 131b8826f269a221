"""The checks of ``er-gym doctor``: what works on this machine, and how to fix the rest."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from ctypes.util import find_library
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import er_gym
from benchmarks.cli.activity import doing
from benchmarks.cli.extras import claimants, extras, installed_version, state_of
from er_gym.integrations.plugs import PLUGS, installed, lacks
from er_gym.plugins import NOT_FROM_HERE
from er_gym.thor import SCENE_NAMES, compiled_kernel, make_controller
from er_gym.thor.client_folder import GpuMapping, Release
from er_gym.thor.launcher import executable_in


@dataclass(frozen=True)
class Check:
    """The result for one part.

    Attributes:
        part: its name.
        works: whether it can be used.
        detail: what was found.
        fix: what would make it work; empty if it works.
        required: whether er-gym needs it for everything.
    """

    part: str
    works: bool
    detail: str
    fix: str = ""
    required: bool = False


def run_checks() -> Iterator[Check]:
    """Check every part, the most important first; each is made when it is asked for."""
    for what, checks in _PARTS.items():
        doing(f"checking {what}")
        for check in checks():
            yield check
            doing(f"checking {what}")


def _engine() -> Iterator[Check]:
    start = time.perf_counter()
    try:
        controller = make_controller(scene=SCENE_NAMES[0], width=300, height=300)
    except Exception as error:  # any failure is a result of this command
        yield Check("embedded engine", False, _as_line(error), _REINSTALL, required=True)
        return
    took = time.perf_counter() - start
    objects = len(controller.last_event.metadata["objects"])
    detail = (
        f"{len(SCENE_NAMES)} scenes; {SCENE_NAMES[0]}, {objects} objects, ready in {took:.1f} s"
    )
    yield Check("embedded engine", True, detail, required=True)
    yield _check("renderer", lambda: _frame(controller), required=True)
    controller.stop()
    yield _compiled_kernel()


def _compiled_kernel() -> Check:
    name = "compiled kernel"
    if compiled_kernel() is not None:
        return Check(name, True, "made by the C compiler; steps are half as long again without it")
    detail = "no C compiler works here; NumPy gives the same results, more slowly"
    return Check(name, False, detail, "apt-get install gcc libc6-dev")


_REINSTALL = "install er-gym again"


def _frame(controller: Any) -> str:
    start = time.perf_counter()
    frame = controller.step("RotateRight", degrees=10).frame
    took = time.perf_counter() - start
    if frame.min() == frame.max():
        raise RuntimeError("the picture has only one colour")
    height, width = frame.shape[:2]
    return f"{width}×{height} in {1000 * took:.0f} ms, on the CPU"


def _player() -> Iterator[Check]:
    yield _check("player", _launch)


def _launch() -> str:
    """Start the player from a launcher of its own: a look at the machine leaves nothing there."""
    with tempfile.TemporaryDirectory(prefix="er-gym-") as folder:
        return _start(executable_in(Path(folder)))


def _start(program: str) -> str:
    begun = time.perf_counter()
    done = subprocess.run(shlex.split(program), capture_output=True, text=True, timeout=60)
    if done.returncode != 2:  # its refusal to start without the client
        raise RuntimeError(f"{program} ended with {done.returncode}: {done.stderr.strip()}")
    return f"starts in {time.perf_counter() - begun:.1f} s; er-gym player path says where it is"


_ASK_THE_CLIENT = """
import json, os
from ai2thor import platform
request = platform.Request("Linux", 300, 300, os.environ.get("DISPLAY"), False)
names = ("Linux64", "CloudRendering")
print(json.dumps({name: getattr(platform, name).validate(request) for name in names}))
"""
_FIXES = {
    "Linux64": "sudo apt install xvfb; xvfb-run -s '-screen 0 1280x1024x24' python PROGRAM",
    "CloudRendering": "sudo apt install libvulkan1 (no GPU is needed)",
}
"""Platform to what satisfies the client's test of the machine."""
_CLIENT = "5.0.0"
"""The version of ai2thor whose protocol the player speaks."""


def _programs() -> Iterator[Check]:
    """Whether AI2-THOR programs start the player without naming it."""
    calls = {"Linux64": "Controller(scene=…)", "CloudRendering": "platform=CloudRendering"}
    try:
        missing = _missing_for_client()
    except (subprocess.SubprocessError, ValueError) as error:
        yield Check(calls["Linux64"], False, _as_line(error), f"pip install ai2thor=={_CLIENT}")
        return
    for platform, call in calls.items():
        yield _program(call, Release(platform), missing[platform])
    if GpuMapping().is_ours:
        yield Check("gpu_device=…", True, "any number works")
    elif GpuMapping().path.exists():
        yield Check("gpu_device=…", True, f"the numbers in {GpuMapping().path}")
    else:
        detail = "the client asks vulkaninfo and nvidia-smi"
        yield Check("gpu_device=…", False, detail, "er-gym player install")


def _missing_for_client() -> dict[str, list[str]]:
    """Platform to what AI2-THOR's client misses on this machine, asked in a new process."""
    program = [sys.executable, "-c", NOT_FROM_HERE + _ASK_THE_CLIENT]
    done = subprocess.run(program, capture_output=True, text=True, timeout=60, check=True)
    missing: dict[str, list[str]] = json.loads(done.stdout)
    return missing


def _program(call: str, release: Release, missing: list[str]) -> Check:
    if release.is_unity:
        fix = "" if not missing else _FIXES[release.platform]
        return Check(call, not missing, "starts Unity's build", fix)
    if not release.is_ours:
        return Check(call, False, "no build is installed", "er-gym player install")
    if missing:
        detail = f"the player is installed, but AI2-THOR's client needs more: {missing[0]}"
        here = "er-gym player install in this Python, or in a virtual environment"
        fix = f"{here}; or {_FIXES[release.platform]}"
        return Check(call, False, detail, fix)
    return Check(call, True, f"starts the player; {version_of_client()}")


def version_of_client() -> str:
    """The client whose build the player replaces, in words."""
    from ai2thor._builds import COMMIT_ID

    there = installed_version("ai2thor")
    known = "" if there == _CLIENT else f" (er-gym was written for {_CLIENT})"
    return f"ai2thor {there}{known}, commit_id {COMMIT_ID[:7]}"


def unity_checks() -> Iterator[Check]:
    """What Unity's build needs, part by part."""
    for platform in ("CloudRendering", "Linux64"):
        release = Release(platform)
        there = "er-gym's player" if release.is_ours else "Unity's build"
        found = f"{there} in {release.path}" if release.path.exists() else f"none in {release.path}"
        fix = "er-gym player uninstall" if release.is_ours else _DOWNLOADED
        yield Check(f"build {platform}", release.is_unity, found, "" if release.is_unity else fix)
    vulkan = find_library("vulkan")
    yield Check(
        "Vulkan library", vulkan is not None, vulkan or "none",
        "" if vulkan else "sudo apt install libvulkan1",
    )  # fmt: skip
    drivers = [file for folder in _DRIVERS for file in sorted(Path(folder).glob("*.json"))]
    yield Check(
        "Vulkan drivers", bool(drivers), ", ".join(file.stem for file in drivers) or "none",
        "" if drivers else "install a GPU's driver, or sudo apt install mesa-vulkan-drivers",
    )  # fmt: skip
    display = os.environ.get("DISPLAY", "")
    yield Check(
        "display", bool(display), display or "DISPLAY is not set",
        "" if display else "only Linux64 needs one: xvfb-run -s '-screen 0 1280x1024x24' …",
    )  # fmt: skip
    free = shutil.disk_usage(Path.home()).free / 1e9
    yield Check("disk", free > 3, f"{free:.0f} GB free", "" if free > 3 else "a build takes 2 GB")
    yield from _unity()


_DOWNLOADED = "the client downloads it at first use, 1 GB from the network"
_DRIVERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d")
"""Where Vulkan's loader looks for drivers."""


def _unity() -> Iterator[Check]:
    """Whether AI2-THOR's own build is installed and can start."""
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
    fixes = []
    if cloud.is_ours or desktop.is_ours:
        fixes.append("er-gym's player replaces it: er-gym player uninstall")
    if not (cloud.is_unity or desktop.is_unity):
        fixes.append("AI2-THOR's client downloads the build at first use, from the network")
    if not vulkan and not display:
        fixes.append("apt install libvulkan1 with a GPU's driver, or start an X server with GLX")
    yield Check("Unity build", works, ", ".join(found), "; ".join(fixes) if not works else "")


def _gpu() -> Iterator[Check]:
    program = shutil.which("nvidia-smi")
    if program is None:
        yield Check("GPU", False, "no NVIDIA driver", "only learning and local models use one")
    else:
        yield _check("GPU", lambda: _gpu_names(program))


def _gpu_names(program: str) -> str:
    query = [program, "--query-gpu=name,memory.total", "--format=csv,noheader"]
    done = subprocess.run(query, capture_output=True, text=True, timeout=20, check=True)
    if not done.stdout.strip():
        raise RuntimeError("nvidia-smi lists none")
    return "; ".join(done.stdout.strip().splitlines())


def _memory_allocator() -> Iterator[Check]:
    """PyTorch takes a tensor's memory anew each time, at which glibc is slow."""
    name = "memory allocator"
    loaded = _loaded_libraries()
    if "libtcmalloc" in loaded:
        yield Check(name, True, "TCMalloc")
    elif loaded:
        detail = "not TCMalloc, with which models learn faster on a CPU"
        fix = (
            "apt install libtcmalloc-minimal4, and LD_PRELOAD=libtcmalloc_minimal.so.4 er-gym "
            "finetune …"
        )
        yield Check(name, False, detail, fix)


def _loaded_libraries() -> str:
    """What this process has loaded, as Linux lists it; empty on other systems."""
    try:
        return Path("/proc/self/maps").read_text(errors="replace")
    except OSError:
        return ""


def _extras() -> Iterator[Check]:
    try:
        names = extras()
    except PackageNotFoundError:
        detail = "er-gym is not installed in this Python, so its extras cannot be looked up"
        yield Check("extras", False, detail, "pip install --editable . in the checkout")
        return
    for name in names:
        state = state_of(name)
        if state.complete:
            yield Check(f"extra {name}", True, ", ".join(state.packages))
            continue
        lacks = [*(f"{each} missing" for each in state.missing), *state.wrong]
        lacks += [f"this Python cannot have {each}" for each in state.unsupported]
        fix = f"pip install 'er-gym[{name}]'" if state.missing or state.wrong else ""
        yield Check(f"extra {name}", False, ", ".join(lacks), fix)


def _plugs() -> Iterator[Check]:
    for plug in PLUGS:
        problems = ", ".join(lacks(plug))
        part = f"plug {plug.name}"
        if problems:
            yield Check(part, False, problems, plug.install)
        else:
            yield Check(part, True, f"{installed(plug)}; {plug.page}")


def _packages() -> Iterator[Check]:
    """Whether ``agents`` and ``benchmarks``, common names for packages, are ours here."""
    for name in ("agents", "benchmarks"):
        spec = find_spec(name)
        place = Path(spec.origin).parents[1] if spec is not None and spec.origin else None
        others = ", ".join(f"{each} {installed_version(each)}" for each in claimants(name))
        if place != _HOME:
            detail = f"this name imports {place or 'no package'}, not er-gym's in {_HOME}"
            detail += f"; {others} has it too" if others else ""
            yield Check(f"package {name}", False, detail, _APART, required=True)
        elif others:
            detail = f"{others} has a package of this name too: the one installed last overwrites"
            yield Check(f"package {name}", False, detail, _APART)
        else:
            yield Check(f"package {name}", True, "er-gym's, and no other distribution's")
    yield _opencv()


def _opencv() -> Check:
    """Whether at most one distribution has installed ``cv2``, which er-gym does not use."""
    owners = claimants("cv2")
    if not owners:
        return Check("package cv2", True, "not installed, and er-gym does not need it")
    both = ", ".join(f"{each} {installed_version(each)}" for each in owners)
    again = f"pip uninstall --yes {' '.join(owners)} && pip install {owners[0]}"
    if len(owners) > 1:
        detail = f"{both}: both write the same files, and er-gym needs neither"
        return Check("package cv2", False, detail, again)
    spec = find_spec("cv2")
    if spec is None or spec.origin is None:
        return Check("package cv2", False, f"{both} has lost files of it", again)
    return Check("package cv2", True, f"{both}, which er-gym does not need")


_HOME = Path(er_gym.__file__).parents[1]
_APART = "give er-gym a virtual environment of its own"


def _check(part: str, act: Callable[[], str], *, required: bool = False) -> Check:
    try:
        return Check(part, True, act(), required=required)
    except Exception as error:  # as above
        return Check(part, False, _as_line(error), _REINSTALL if required else "", required)


def _as_line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


_PARTS: dict[str, Callable[[], Iterator[Check]]] = {
    "the engine": _engine,
    "the player": _player,
    "AI2-THOR's client": _programs,
    "Unity": _unity,
    "the GPU": _gpu,
    "the memory allocator": _memory_allocator,
    "the packages": _packages,
    "the extras": _extras,
    "the plugs": _plugs,
}
"""What is checked, and how."""
