"""What an agent is told about its action: in plain words, and in the language of its prompts.

No feedback holds ids, scene names, positions or messages of the simulator.
``info["error_message"]`` has the simulator's message.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Literal, TypeAlias

from er_gym.envs import feedback_words as words
from er_gym.envs.actions import parse
from er_gym.envs.thor_errors import is_raw, problem_of

Language: TypeAlias = Literal["en", "zh"]
"""The languages that the environment's words exist in."""
_LISTS = frozenset({"places", "alone", "others", "tools"})
_OR_ARTICLE = re.compile(r"(?:^|(?<= ))an? (?=[A-Z])")
_NOTHING, _NOTHING_ZH = "nothing", "无"
_RECENT = 4096


def failed(action: object, problem: str, error_message: str) -> str:
    """The feedback to a legal action that was not done.

    Args:
        action: the action.
        problem: why, in the environment's words; ``""`` if only the simulator says why.
        error_message: the simulator's message.
    """
    return words.FAILED(action=action, problem=problem or problem_of(error_message))


def as_now(feedback: str) -> str:
    """A recorded feedback as the environment words it today.

    Older recordings quote the simulator's messages, and their sentences on failures lack the full
    stop. All other texts stay as they are.
    """
    before, colon, problem = feedback.partition(": ")
    if not colon or not before.startswith("You could not "):
        return feedback
    action = before.removeprefix("You could not ")
    if parse(action) is None:
        return feedback
    if is_raw(problem):
        return failed(action, "", problem)
    return failed(action, problem.rstrip("."), "")


def told_in(language: Language, feedback: str) -> str:
    """The environment's feedback in a language; a text that is not the environment's stays."""
    return feedback if language == "en" else _in_chinese(feedback)


@lru_cache(maxsize=_RECENT)
def _in_chinese(text: str) -> str:
    for sentence in words.SENTENCES:
        found = sentence.pattern.fullmatch(text)
        if found is not None:
            slots = {name: _slot(name, value) for name, value in found.groupdict().items()}
            return sentence.zh.format(**slots)
    return text


def _slot(name: str, value: str) -> str:
    if name in ("problem", "why"):
        return _in_chinese(value)
    if name not in _LISTS:
        return value
    if value == _NOTHING:
        return _NOTHING_ZH
    return _OR_ARTICLE.sub("", value).replace(", ", "、").replace(" or ", " 或 ")
