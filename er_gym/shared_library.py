"""Shared libraries that come from memory, and those that the machine's C compiler makes."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from hashlib import blake2b
from pathlib import Path

from er_gym.writing import kept

_EXACT = ("-O2", "-ffp-contract=off")
"""No instructions of this processor alone, and no fused ones: each result is that of NumPy."""
_FAST = ("-O3", "-march=native", "-fopenmp-simd", "-fno-math-errno", "-fno-trapping-math")
"""All instructions of this processor, and sums in any order: right but for rounding."""
_SECONDS = 60.0
"""For which a compiler is waited for."""


def load(path: str) -> ctypes.PyDLL | None:
    """The library at a path or of a name, None if the system does not load it.

    Calls of its functions keep the GIL.
    """
    try:
        # Local, because another library may bring its own of the same name.
        return ctypes.PyDLL(path, mode=ctypes.RTLD_LOCAL)
    except OSError:
        return None


def load_bytes(content: bytes, name: str) -> ctypes.PyDLL | None:
    """The library with some content, None if the system does not load it."""
    return load_from_file(content, name) or load_from_memory(content, name)


def load_from_file(content: bytes, name: str) -> ctypes.PyDLL | None:
    """As :func:`load_bytes`, from a file that is deleted again."""
    try:
        with tempfile.TemporaryDirectory(prefix="er-gym-") as folder:
            path = Path(folder, name)
            path.write_bytes(content)
            return load(str(path))
    except OSError:
        return None


def load_from_memory(content: bytes, name: str) -> ctypes.PyDLL | None:
    """As :func:`load_bytes`, for machines that let no file be written or executed."""
    try:
        handle = os.memfd_create(name)
    except (AttributeError, OSError):
        return None
    with open(handle, "wb", buffering=0) as file:
        file.write(content)
        return load(f"/proc/self/fd/{handle}")


def compiled(source: Path, *, exact: bool = True) -> ctypes.PyDLL | None:
    """The library of a C source, which the machine's compiler makes once for the user's cache.

    Args:
        source: the source.
        exact: whether each result must be that of NumPy to the bit; otherwise it is right but for
            rounding, and quicker.

    Returns:
        None where there is no C compiler, on systems other than Linux, and if anything fails:
        whoever asks has another way to the same results.
    """
    if sys.platform != "linux":
        return None
    text = source.read_bytes()
    digest = blake2b(digest_size=8)
    flags = _EXACT if exact else _FAST
    machine = platform.machine() if exact else _processor()
    for part in (text, " ".join(flags).encode(), machine.encode()):
        digest.update(part)
    name = f"{source.stem}.so"
    try:
        content = kept("compiled", digest.hexdigest(), name, lambda: _compile(source, flags))
    except (OSError, subprocess.SubprocessError):
        return None
    return load_bytes(content, name)


def _processor() -> str:
    """What tells processors with different instructions apart: a home may be shared by machines."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
    except OSError:
        return platform.machine()
    told = (line for line in lines if line.startswith(("flags", "Features", "model name")))
    return "\n".join(sorted(set(told)))


def compiler() -> str | None:
    """The path of the machine's C compiler, None if there is none."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def _compile(source: Path, flags: Sequence[str]) -> bytes:
    program = compiler()
    if program is None:
        raise FileNotFoundError("no C compiler is on the PATH")
    with tempfile.TemporaryDirectory(prefix="er-gym-") as folder:
        made = Path(folder, "made.so")
        subprocess.run(
            [program, *flags, "-fPIC", "-shared", "-pthread", "-o", str(made), str(source), "-lm"],
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_SECONDS,
        )
        return made.read_bytes()
