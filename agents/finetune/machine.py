"""What the machine has: memory to train in, and what is used of it."""

from __future__ import annotations

import contextlib
import ctypes
import os
from pathlib import Path
from typing import Any

import torch

_CGROUP = Path("/sys/fs/cgroup")


def on_gpu() -> bool:
    """Whether training runs on a GPU."""
    return torch.cuda.is_available()


def has_fast_bfloat16() -> bool:
    """Whether matrices are multiplied faster in bfloat16 than in float32.

    A CPU without such instructions can do it, too, but more slowly.
    """
    if on_gpu():
        return torch.cuda.is_bf16_supported()
    able: dict[str, Any] = getattr(torch.cpu, "get_capabilities", dict)()
    return bool(able.get("avx512_bf16") or able.get("amx_bf16"))


def is_first() -> bool:
    """Whether this is the first of the processes that a launcher started, or the only one."""
    return os.environ.get("RANK", "0") == "0"


def share_gpus() -> bool:
    """Let the processes of this machine share its GPUs if there are more processes; says whether
    they do.

    One process that plays with a small model does not fill a GPU. accelerate takes the number of a
    process for that of its GPU, which then is not there.
    """
    gpus = torch.cuda.device_count()
    if not 0 < gpus < int(os.environ.get("LOCAL_WORLD_SIZE", "1")):
        return False
    os.environ["LOCAL_RANK"] = str(int(os.environ["LOCAL_RANK"]) % gpus)
    return True


def free_memory() -> int:
    """Bytes that training may take: the GPU's, or those of the machine or of its container."""
    if on_gpu():
        return int(torch.cuda.mem_get_info()[0])
    free = [os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    for line in _lines(Path("/proc/meminfo")):
        if line.startswith("MemAvailable:"):
            free = [int(line.split()[1]) * 1024]
    limit = "".join(_lines(_CGROUP / "memory.max")).strip()
    used = "".join(_lines(_CGROUP / "memory.current")).strip()
    if limit.isdigit() and used.isdigit():
        cached = sum(
            int(line.split()[1])
            for line in _lines(_CGROUP / "memory.stat")
            if line.startswith("inactive_file ")
        )
        free.append(int(limit) - int(used) + cached)
    return min(free)


def used_memory() -> int:
    """Bytes in use: the most so far on the GPU, or this process's on a CPU."""
    if on_gpu():
        return int(torch.cuda.max_memory_allocated())
    pages = "".join(_lines(Path("/proc/self/statm"))).split()
    return int(pages[1]) * os.sysconf("SC_PAGE_SIZE") if pages else 0


def give_memory_back() -> None:
    """Return to the system what was freed.

    Linux's C library keeps freed memory that lies between blocks in use: gigabytes, after the
    caches of many conversations.
    """
    with contextlib.suppress(OSError, AttributeError):  # another system's library has no such call
        ctypes.CDLL(None).malloc_trim(0)


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
