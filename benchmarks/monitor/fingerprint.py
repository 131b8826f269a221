"""Whether a directory is in use, and a fingerprint that changes whenever it does.

Both come from its files' names, times and sizes alone, so that they can be asked often.
"""

from __future__ import annotations

import os
import socket
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.monitor.directories import Directory, Kind
from er_gym.locking import LOCK

_GROWING: Mapping[Kind, Sequence[str]] = {
    "policy": ("curve.jsonl", LOCK, "model.npz"),
    "finetuning": ("metrics.jsonl", "finetune.json", "model", LOCK),
    "reinforcement": ("metrics.jsonl", "reinforce.json", "model", LOCK),
    "ladder": ("ladder.json", "result.json", LOCK),
    "ablation": ("ablation.json", "result.json", LOCK),
    "collection": ("collection.json", "trajectories.jsonl", "parts", LOCK),
}
"""The files by whose times and sizes a directory is seen to change."""
_MOST_PARTS = 50


def fingerprint(directory: Directory) -> object:
    """What changes whenever a directory does that is no run."""
    names = list(_GROWING.get(directory.kind, ()))
    if directory.kind == "collection":
        names += [f"parts/{part}/events.jsonl" for part in parts_of(directory.path)]
    return tuple(_state(directory.path / name) for name in names)


def parts_of(collection: Path) -> list[str]:
    """The names of a collection's parts that have begun."""
    try:
        with os.scandir(collection / "parts") as entries:
            found = [each.name for each in entries if each.is_dir(follow_symlinks=False)]
    except OSError:
        return []
    return sorted(found)[:_MOST_PARTS]


def changed(directory: Directory) -> float:
    """When it changed last, seconds since the epoch; 0 if unknown."""
    told = [_state(directory.path / name) for name in _GROWING.get(directory.kind, ())]
    return max((each[0] for each in told if each), default=0) / 1e9


def in_use(folder: Path) -> bool:
    """Whether a process holds the folder's lock, as far as it can be seen without touching it.

    A killed process leaves its lock's file; that the file names no living process tells so. A
    process of another machine is taken to live.
    """
    try:
        told = (folder / LOCK).read_bytes()[:300].decode("ascii").split()
    except (OSError, ValueError):
        return False
    if len(told) != 2 or not told[0].isdigit() or len(told[0]) > 18:
        return False
    if told[1] != socket.gethostname():
        return True
    try:
        os.kill(int(told[0]), 0)  # asks whether it is there
    except PermissionError:
        return True
    except (OSError, OverflowError):
        return False
    return True


def _state(file: Path) -> tuple[int, int] | None:
    try:
        status = file.stat()
    except OSError:
        return None
    return status.st_mtime_ns, status.st_size
