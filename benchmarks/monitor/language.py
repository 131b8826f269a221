"""The words of the pages, in English and Chinese."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib.resources import files

import yaml

LANGUAGES = ("en", "zh")


@cache
def words_in(language: str) -> Mapping[str, str]:
    """All words of a language by key."""
    text = files("benchmarks.monitor").joinpath("words", f"{language}.yaml")
    words: dict[str, str] = yaml.safe_load(text.read_text(encoding="utf-8"))
    return words


class Translator:
    """Says words in a language.

    Args:
        language: one of :data:`LANGUAGES`.
    """

    def __init__(self, language: str) -> None:
        self.language = language
        self._words = words_in(language)

    def __call__(self, key: str, **values: object) -> str:
        """The words for a key, with values in their places."""
        return self._words[key].format(**values)

    def name(self, key: str) -> str:
        """The words for a name that may have none, such as an agent's reason: then the name."""
        return self._words.get(key, key)


def chosen_language(cookie: str, accepted: str) -> str:
    """The language of a request.

    Args:
        cookie: what the reader chose before; "" for nothing.
        accepted: the header ``Accept-Language``.
    """
    if cookie in LANGUAGES:
        return cookie
    first = accepted.split(",")[0].strip().lower()
    return "zh" if first.startswith("zh") else "en"
