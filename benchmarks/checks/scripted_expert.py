"""A server that answers as a model that writes thoughts would, and misbehaves in twenty ways.

It reads the prompts of ``configs/prompts/expert/en`` and, for a model that decides, of
``configs/prompts/default/en`` with the plan as a hint.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from benchmarks.harness.chat_server import (
    GOOD,
    ChatServer,
    Fault,
    Messages,
    body,
    drawn,
    error,
    replies,
    text_of,
)

_TAG = re.compile(r"^<(Observation|Thinking|Planning|Reflection|Verification)>", re.MULTILINE)
_DECISION = re.compile(r"The robot's decision: ([^,(]+?) ?(?:\(the ([^)]+)\))?, ")
_PLAN = re.compile(r"in this order: (.+?)\. You may look elsewhere")
_ORDINALS = (
    "first", "second", "third", "fourth", "fifth",
    "sixth", "seventh", "eighth", "ninth", "tenth",
    "eleventh", "twelfth", "thirteenth", "fourteenth", "fifteenth",
    "sixteenth", "seventeenth", "eighteenth", "nineteenth", "twentieth",
)  # fmt: skip
_LEADS: Mapping[str, str] = {
    "Observation": "Let me take in what is before me as I come to my {nth} move.",
    "Thinking": "I think about where I am with my task before my {nth} move.",
    "Planning": "My {nth} move should follow from what I know so far.",
    "Reflection": "That did not bring me further, so my {nth} move should be another.",
    "Verification": "I go through the task once more at my {nth} move.",
}
_DEEDS: Mapping[str, str] = {
    "navigate to": "I will go to the {name} next.",
    "pickup": "I will pick up the {name} now.",
    "put in": "I will put it down at the {name} now.",
    "open": "I will open the {name} now.",
    "close": "I will close the {name} now.",
    "toggle": "I will switch the {name} now.",
    "slice": "I will slice the {name} now.",
    "observe": "I will look around now.",
    "move forward": "I will take a step forward now.",
    "end": "The task is done, so I will stop here.",
}


def good(messages: Messages) -> str:
    """What a model says that does as it is asked."""
    last = text_of(messages[-1])
    if "square brackets" in last:
        return _places(last)
    if "DecisionMaking" in text_of(messages[0]):
        return _decision(messages)
    asked = _TAG.findall(last)
    thoughts = _thoughts(messages, asked)
    return "\n".join(f"<{tag}>{thoughts[tag]}</{tag}>" for tag in asked)


def _thoughts(messages: Messages, asked: Sequence[str]) -> dict[str, str]:
    turn = text_of(messages[1])
    found = _DECISION.search(turn)
    assert found is not None, turn
    done = len(re.findall(r"^   -> ", turn, re.MULTILINE))
    nth = _ORDINALS[min(done, len(_ORDINALS) - 1)]
    deed = next(words for verb, words in _DEEDS.items() if found[1].startswith(verb))
    said = {tag: _LEADS[tag].format(nth=nth) for tag in asked}
    said[asked[-1]] += " " + deed.format(name=found[2])
    return said


def _places(prompt: str) -> str:
    names = prompt.split("\n\n")[1].split(", ")
    return f"[{', '.join(['Narnia', *reversed(names)])}]"


def _decision(messages: Messages) -> str:
    planned = _PLAN.search(text_of(messages[1]))
    actions = planned[1].split("; ") if planned else []
    done = sum(message["role"] == "assistant" for message in messages)
    action = actions[done] if done < len(actions) else "end"
    thought = f"This is my {_ORDINALS[min(done, len(_ORDINALS) - 1)]} step in this room."
    return f"<Planning>{thought}</Planning><DecisionMaking>{action}</DecisionMaking>"


def in_tags(words: str) -> Callable[[Messages], str]:
    """Says the same in every tag that is asked for."""
    return lambda messages: "\n".join(
        f"<{tag}>{words}</{tag}>" for tag in _TAG.findall(text_of(messages[-1]))
    )


def _lies(messages: Messages) -> str:
    lie = "I can see a ToiletPaperHanger and a BaseballBat right in front of me. "
    return _TAG.sub(lambda tag: tag[0] + lie, good(messages))


def _cut(messages: Messages) -> str:
    said = good(messages)
    return said[: said.rindex("</")]


SAYS: Mapping[str, Callable[[Messages], str]] = {
    "a refusal": lambda _: "I'm sorry, but I can't help with that.",
    "a refusal in tags": in_tags("I'm sorry, but I can't assist with that request."),
    "an error in tags": in_tags("Error: HTTP 500, the request failed: internal server error."),
    "a rate limit in tags": in_tags("Error code: 429 - Rate limit reached, too many requests."),
    "nothing": lambda _: "",
    "no tags": lambda _: "I think that I should go on with my task now.",
    "wrong tags": lambda messages: _TAG.sub("<Thought>", good(messages)).replace("</", "</x"),
    "tags without text": in_tags(""),
    "tags twice": lambda messages: 2 * good(messages),
    "lies": _lies,
    "the hint": in_tags("According to the hint, the intended decision is right."),
    "another decision": in_tags("I have thought it over. I will go to the Bathtub next."),
    "too much": in_tags("I keep on thinking about this room and about my task. " * 60),
    "French": in_tags("Je vais dans la cuisine et je regarde autour de moi pour la pomme."),
    "a speaker": in_tags("Assistant: I will go on with it."),
}
"""Answers that are no thoughts of the robot, by name."""


def answers(say: Callable[[Messages], str], **changed: Any) -> Fault:
    """A good answer in form, with these words; about four bytes are counted as a token."""
    return replies(say, tokens=_tokens, **changed)


def _tokens(heard: bytes, said: str) -> tuple[int, int]:
    return len(heard) // 40 + 1, len(said) // 4 + 1  # most of what is heard is pictures


FAILS: Mapping[str, Fault] = {
    "429": error(429, "slow down", Retry_After="0.05"),
    "500": error(500, "something broke"),
    "half a body": body(GOOD[:-40]),
    "a page": body(b"<html>Welcome</html>"),
    "cut": answers(_cut, choices__0__finish_reason="length"),
    "slow": replies(good, tokens=_tokens, latency=0.4),
}
"""Faults of the server, by name."""


def scripted_expert(bad: float = 0.0, failing: float = 0.0, seed: int = 0) -> ChatServer:
    """A server; use it as a context manager.

    Args:
        bad: the share of answers in :data:`SAYS`, each as often as the others.
        failing: the share of faults in :data:`FAILS`.
        seed: of the draws.
    """
    faults = {"good": (1.0 - bad - failing, answers(good))}
    faults |= {name: (bad / len(SAYS), answers(say)) for name, say in SAYS.items()}
    faults |= {name: (failing / len(FAILS), fault) for name, fault in FAILS.items()}
    return ChatServer(drawn(faults, seed))
