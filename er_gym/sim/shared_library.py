"""Shared libraries that come from memory, and those that the machine's C compiler makes."""

from __future__ import annotations

import ctypes
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from hashlib import blake2b
from pathlib import Path

from er_gym.writing import kept

_FLAGS = ("-O2", "-ffp-contract=off", "-fPIC", "-shared")
"""No instructions of this processor alone, and no fused ones: each result is that of NumPy."""
_SECONDS = 60.0
"""For which a compiler is waited for."""


def load(path: str) -> ctypes.PyDLL | None:
    """The library at a path or of a name, None if the system does not load it."""
    try:
        # Local, because another library may bring its own of the same name. Calls keep the GIL.
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


def compiled(source: Path) -> ctypes.PyDLL | None:
    """The library of a C source, which the machine's compiler makes once for the user's cache.

    Returns:
        None where there is no C compiler, on systems other than Linux, and if anything fails:
        whoever asks has another way to the same results.
    """
    if sys.platform != "linux":
        return None
    text = source.read_bytes()
    digest = blake2b(digest_size=8)
    for part in (text, " ".join(_FLAGS).encode(), platform.machine().encode()):
        digest.update(part)
    name = f"{source.stem}.so"
    try:
        content = kept("compiled", digest.hexdigest(), name, lambda: _compile(source))
    except (OSError, subprocess.SubprocessError):
        return None
    return load_bytes(content, name)


def compiler() -> str | None:
    """The path of the machine's C compiler, None if there is none."""
    return shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")


def _compile(source: Path) -> bytes:
    program = compiler()
    if program is None:
        raise FileNotFoundError("no C compiler is on the PATH")
    with tempfile.TemporaryDirectory(prefix="er-gym-") as folder:
        made = Path(folder, "made.so")
        subprocess.run(
            [program, *_FLAGS, "-o", str(made), str(source), "-lm"],
            check=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_SECONDS,
        )
        return made.read_bytes()
