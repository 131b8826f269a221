"""What is used of the machine: its memory, and its GPUs."""

from __future__ import annotations

import os
import platform

import pytest
import torch

from agents.finetune.machine import give_memory_back, share_gpus, used_memory


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="another C library has no such call")
def test_memory_between_blocks_in_use_goes_back():
    freed, kept = [], []
    for number in range(600):  # 120 MB, in blocks that the library does not map by themselves
        freed.append(torch.zeros(40_000 + 30 * number))
        kept.append(torch.zeros(100 + number))
    full = used_memory()
    freed.clear()
    give_memory_back()
    assert full - used_memory() > 80e6
    assert all(not each.any() for each in kept)


@pytest.mark.parametrize(
    ("gpus", "processes", "shared"), [(0, 4, False), (1, 1, False), (4, 4, False), (2, 3, True)]
)
def test_more_processes_than_gpus_share_them(
    gpus: int, processes: int, shared: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch.cuda, "device_count", lambda: gpus)
    monkeypatch.setenv("LOCAL_WORLD_SIZE", str(processes))
    monkeypatch.setenv("LOCAL_RANK", str(processes - 1))
    assert share_gpus() is shared
    assert int(os.environ["LOCAL_RANK"]) == (0 if shared else processes - 1)
