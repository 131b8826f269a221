"""Words and sentences of thoughts, in English and Chinese."""

from __future__ import annotations

import re
from math import ceil

_CHINESE = re.compile(r"[\u3400-\u9fff\uf900-\ufaff]")
_WORD = re.compile(r"[^\W\u3400-\u9fff\uf900-\ufaff]+(?:['’-][^\W\u3400-\u9fff\uf900-\ufaff]+)*")
_END = re.compile(r"([.!?…][\"'”’)]*)\s+|([。！？…][”’」）]*)\s*")
"""The end of a sentence, with what closes a quotation."""


def count_words(text: str) -> int:
    """How many words a text has; two Chinese characters count as one."""
    return len(_WORD.findall(text)) + ceil(len(_CHINESE.findall(text)) / 2)


def sentences(text: str) -> list[str]:
    """The sentences of a text, in order, without spaces around them."""
    lines = _END.sub(lambda end: f"{end[1] or end[2]}\n", text).splitlines()
    return [line.strip() for line in lines if line.strip()]
