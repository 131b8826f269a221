"""Words and sentences of thoughts, in English and Chinese."""

from __future__ import annotations

import re
from math import ceil

_CHINESE = re.compile(r"[\u3400-\u9fff\uf900-\ufaff]")
_WORD = re.compile(r"[^\W\u3400-\u9fff\uf900-\ufaff]+(?:['’-][^\W\u3400-\u9fff\uf900-\ufaff]+)*")
_END = re.compile(r"(?<=[.!?…])[\"'”’)]*\s+|(?<=[。！？…])[”’」）]*\s*|\n+")


def count_words(text: str) -> int:
    """How many words a text has; two Chinese characters count as one."""
    return len(_WORD.findall(text)) + ceil(len(_CHINESE.findall(text)) / 2)


def sentences(text: str) -> list[str]:
    """The sentences of a text, in order, without spaces around them."""
    return [part.strip() for part in _END.split(text) if part.strip()]
