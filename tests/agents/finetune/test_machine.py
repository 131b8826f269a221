"""What is used of the machine's memory."""

from __future__ import annotations

import platform

import pytest
import torch

from agents.finetune.machine import give_memory_back, used_memory


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
