"""Keeps the libraries of models quiet, and their arithmetic fast."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import torch
import transformers


@contextmanager
def quiet_libraries() -> Iterator[None]:
    """Without the libraries' own progress bars, and warnings about what they ask of each other."""
    shown = transformers.utils.logging.is_progress_bar_enabled()
    transformers.utils.logging.disable_progress_bar()
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", message=".*is_gradient_checkpointing")  # peft 0.21
            yield
    finally:
        if shown:
            transformers.utils.logging.enable_progress_bar()


@contextmanager
def flush_denormals() -> Iterator[None]:
    """Flush denormal numbers to 0 within the context."""
    # AdamW's moments of rows that no token uses decay to denormal numbers, which makes every
    # operation on them many times slower.
    torch.set_flush_denormal(True)
    try:
        yield
    finally:
        torch.set_flush_denormal(False)
