"""Reads the thoughts out of a model's reply, strictly: each in its tag, whole, and once."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from agents.vlm.chat import Reply
from er_gym.data.critic import LONGEST_WORD, Refusal
from er_gym.data.trajectory import TAG_OF_KIND, ThoughtKind

NO_REPLY = "no reply"
"""The code of a request without a reply, after all tries."""
_RUN, _CHINESE_RUN = 9, 14
"""So many words in a row, or Chinese characters, are no coincidence."""
_HAN = re.compile(r"[一-鿿]")
_WORD = re.compile(r"[一-鿿]|[a-z']+")
_OTHER_VOICE = re.compile(r"\bthe robot\b|机器人", re.IGNORECASE)


@dataclass(frozen=True)
class ReadThought:
    """What a reply holds for one kind of thought.

    Attributes:
        text: the thought; ``""`` if there is none that can be used.
        refusals: why not. Beside the critic's codes there are ``empty`` (the reply says nothing),
            ``missing`` (it lacks the tag, as a model's refusal does), ``cut`` (it breaks off),
            ``twice`` (the tag comes several times), ``echo`` (it repeats the prompt) and ``voice``
            (it speaks of the robot as of somebody else).
    """

    text: str = ""
    refusals: tuple[Refusal, ...] = ()


def read_thought(reply: Reply, kind: ThoughtKind, limit: int) -> ReadThought:
    """The thought of one kind.

    Args:
        reply: the reply.
        kind: the kind that was asked for.
        limit: the most words.
    """
    tag = TAG_OF_KIND[kind]
    start, end = f"<{tag}>", f"</{tag}>"
    if not reply.text.strip():
        return _refused("empty", f"The reply was empty. Write {start}…{end}.")
    starts, ends = reply.text.count(start), reply.text.count(end)
    if not starts:
        return _refused("missing", f"There is no {start}…{end} in the reply. Write it.")
    if not ends:
        return _refused("cut", f"The thought breaks off: {end} is missing. Be brief.")
    if starts > 1 or ends > 1:
        return _refused("twice", f"There must be one {start} and one {end}, no more.")
    at, to = reply.text.index(start) + len(start), reply.text.index(end)
    text = " ".join(reply.text[at:to].split())
    if len(text) > LONGEST_WORD * limit:
        return _refused("length", f"The thought is far too long; write at most {limit} words.")
    return ReadThought(text)


@dataclass(frozen=True)
class EchoCheck:
    """Checks that a thought does not copy the prompt, and speaks as the robot.

    Attributes:
        prompts: runs of words of the prompts' own texts.
    """

    prompts: frozenset[tuple[str, ...]]

    @classmethod
    def against(cls, texts: Iterable[str]) -> EchoCheck:
        """Against runs of words of these texts."""
        return cls(frozenset(run for text in texts for run in _runs(text)))

    def refusals(self, text: str) -> tuple[Refusal, ...]:
        """Refusals of a thought that copies the instructions, as small models do."""
        found = []
        if any(run in self.prompts for run in _runs(text)):
            found.append(Refusal("echo", "This repeats what you were told; use your own words."))
        if _OTHER_VOICE.search(text):
            found.append(Refusal("voice", "Speak as the robot: say “I”, not “the robot”."))
        return tuple(found)


def _runs(text: str) -> Iterator[tuple[str, ...]]:
    words = _WORD.findall(text.lower())
    length = _CHINESE_RUN if _HAN.search(text) else _RUN
    yield from zip(*(words[start:] for start in range(length)), strict=False)


def quoted(reply: Reply, most: int = 6_000) -> str:
    """A reply as it is quoted back to the model, cut if it is very long."""
    said = reply.text.strip()
    return (said if len(said) <= most else said[:most] + " …") or "(nothing)"


def codes_of(refusals: Sequence[Refusal]) -> list[str]:
    """The codes of an attempt, each once."""
    return list(dict.fromkeys(each.code for each in refusals))


def _refused(code: str, detail: str) -> ReadThought:
    return ReadThought(refusals=(Refusal(code, detail),))
