"""A server that answers as a model that writes thoughts would, and misbehaves in twenty ways.

It reads the prompts of ``configs/prompts/expert/en`` and, for a model that decides, of
``configs/prompts/default/en`` with the plan as a hint.
"""

from __future__ import annotations

import hashlib
import json
import random
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from benchmarks.checks.faulty_server import Exchange, FaultyServer, body, completion, error

Messages = Sequence[Mapping[str, Any]]
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


def text_of(message: Mapping[str, Any]) -> str:
    """The texts of a message, without its pictures."""
    content = message["content"]
    if isinstance(content, str):
        return content
    return "\n".join(part.get("text", "") for part in content)


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


@dataclass
class ScriptedExpert(FaultyServer):
    """The server; its faults are drawn for each request.

    Attributes:
        repeated: how many requests came again that had a whole answer before.
    """

    repeated: int = 0
    _answered: set[bytes] = field(default_factory=set)

    def __enter__(self) -> ScriptedExpert:
        super().__enter__()
        return self

    def note_answer(self, request: bytes) -> None:
        """Note that a request gets a whole answer."""
        digest = hashlib.sha256(request).digest()
        with self.lock:
            self.repeated += digest in self._answered
            self._answered.add(digest)


def answers(say: Callable[[Messages], str], **changed: Any) -> Callable[[Exchange], None]:
    """A good answer in form, with these words; tokens are counted as four bytes each."""

    def fault(exchange: Exchange) -> None:
        words = say(json.loads(exchange.body)["messages"])
        assert isinstance(exchange.faulty, ScriptedExpert)
        exchange.faulty.note_answer(exchange.body)
        heard, said = len(exchange.body) // 40 + 1, len(words) // 4 + 1
        counts = {"prompt_tokens": heard, "completion_tokens": said, "total_tokens": heard + said}
        exchange.send(
            json.dumps(
                completion(choices__0__message__content=words, usage=counts, **changed)
            ).encode()
        )

    return fault


def _slow(exchange: Exchange) -> None:
    exchange.faulty.closing.wait(0.4)
    answers(good)(exchange)


FAILS: Mapping[str, Callable[[Exchange], None]] = {
    "429": error(429, "slow down", Retry_After="0.05"),
    "500": error(500, "something broke"),
    "half a body": body(json.dumps(completion()).encode()[:-40]),
    "a page": body(b"<html>Welcome</html>"),
    "cut": answers(_cut, choices__0__finish_reason="length"),
    "slow": _slow,
}
"""Faults of the server, by name."""


def scripted_expert(bad: float = 0.0, failing: float = 0.0, seed: int = 0) -> ScriptedExpert:
    """A server; use it as a context manager.

    Args:
        bad: the share of answers in :data:`SAYS`, each as often as the others.
        failing: the share of faults in :data:`FAILS`.
        seed: of the draws.
    """
    draws = random.Random(seed)

    def fault(exchange: Exchange) -> None:
        with exchange.faulty.lock:
            drawn, which = draws.random(), draws.random()
        chosen: Callable[[Exchange], None] = answers(good)
        if drawn < bad:
            chosen = answers([*SAYS.values()][int(which * len(SAYS))])
        elif drawn < bad + failing:
            chosen = [*FAILS.values()][int(which * len(FAILS))]
        chosen(exchange)

    return ScriptedExpert(fault)
