"""Gives every reader of what a model or a stranger wrote long texts that are hard to read.

    python -m benchmarks.checks.long_texts [WORD …]

Each reader whose name holds a given word reads each text. A reader may take time that is linear in
the text, and no error of its own. Two budgets tell:

- lines of Python: for a text twice as long a reader may run hardly more than twice the lines;
- processor time: a text of 100,000 characters may take two seconds of this process. Regular
  expressions run no lines, and one that is quadratic takes minutes.

Neither depends on what else the machine does. Prints the failures. The exit code is 1 if there is
one.
"""

from __future__ import annotations

import json
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from types import FrameType
from typing import Any

from benchmarks.harness.tally import Tally, Try, has_words, run_check, tally

LONG = 100_000
_SHORT = 1_500
_MOST_SECONDS = 2.0
_MOST_GROWTH, _FEW_LINES = 2.6, 2_000
"""The most lines for a text twice as long, in lines for the text; a start-up of so many is free."""

Reader = Callable[[str], object]
BOUNDED = frozenset(
    {"a thought of the greatest length", "a thought of the greatest length in Chinese"}
)
"""Readers of texts that are cut: the lines for them may grow faster, up to the cut."""


# -- texts -----------------------------------------------------------------------------------------

_PIECES: Mapping[str, str] = {
    "openers": "<Planning>",
    "closers": "</Planning>",
    "decisions": "<DecisionMaking>",
    "decisions that end": "<DecisionMaking>end</DecisionMaking>",
    "thoughts of reasoning models": "<think>",
    "ends of such thoughts": "</think>",
    "thoughts in tags": "<Planning>a</Planning>",
    "calls": "<tool_call>",
    "functions": "<function=open>",
    "parameters": "<parameter=object>",
    "invocations": '<invoke name="open">',
    "half tags": "<",
    "spaces": " ",
    "tabs": "\t",
    "lines": "\n",
    "carriage returns": "\r\n",
    "sentences without words": ". ",
    "full stops": ".",
    "questions": "? ",
    "double quotes": '"',
    "single quotes": "'",
    "backslashes": "\\",
    "backslashes and quotes": '\\"',
    "fences": "```",
    "digits": "1",
    "numbers": "1. ",
    "braces": "{",
    "closing braces": "}",
    "brackets": "[",
    "brackets and braces": "[{",
    "pairs": '{"a":',
    "half strings": '{"action": "',
    "fields": '"action": "open", ',
    "parentheses": "(",
    "commas": ",",
    "colons": ": ",
    "asterisks": "**",
    "underscores": "_",
    "hyphens": "-",
    "bars": "|",
    "arrows": "->",
    "letters": "a",
    "words": "put ",
    "prepositions": "in ",
    "puts": "put Apple in ",
    "puts in lines": "put Apple in Fridge\n",
    "arrows between names": "put Apple -> Fridge ",
    "then": "open Fridge then ",
    "befores": "before a, b ",
    "afters": "a after doing ",
    "labels": "Action: ",
    "inputs": "Action: put\nAction Input: {\n",
    "names": "Apple, ",
    "names joined": "Apple and ",
    "negations": "I do not see an Apple and no Bowl, ",
    "places": "the Apple is not in the Fridge on the Table ",
    "counts": "two Apples, three ",
    "tasks": "Task: ",
    "quoted tasks": "Task: 'a' ",
    "feedback": "<|feedback|>",
    "pictures": "<image>",
    "headings": "#",
    "rules": "---\n",
    "slots": "{task} ",
    "Chinese": "把苹果放进",
    "Chinese letters": "苹",
    "Chinese stops": "。",
    "mixed": "the 苹果 in 冰箱 ",
    "wide letters": "Ａ",
    "combining marks": "e\u0301\u0327",
    "hidden marks": "\u202e\u200b",
    "emoji": "👩‍👩‍👧",
    "lone surrogates": "\ud800",
    "nulls": "\0",
    "capitals": "I",
    "maximum": "maximum images exceed ",
    "keys": "Bearer sk-abcdefgh ",
}
_FRAMES: Mapping[str, tuple[str, str]] = {
    "": ("", ""),
    " in a decision": ("<DecisionMaking>", "</DecisionMaking>"),
    " in JSON": ('{"action": "open", "object": "', '"}'),
    " after a word": ("put Apple", "x"),
}


def texts(length: int, *, framed: bool = True) -> Iterator[tuple[str, str]]:
    """The hard texts: name and text of about this many characters, also within other words if they
    are to be ``framed``."""
    frames = _FRAMES if framed else {"": ("", "")}
    for name, piece in _PIECES.items():
        body = piece * (length // len(piece))
        for frame, (before, after) in frames.items():
            yield f"{name}{frame}", f"{before}{body}{after}"
    half = length // 2
    yield "nested tags", "<Planning>" * (half // 10) + "</Planning>" * (half // 11)
    yield "nested braces", "{" * half + "}" * half
    yield "a thought that never ends", "<think>" + "I go. " * (length // 6)
    yield "openers of two kinds", "<Planning><Observation>" * (length // 23)


# -- readers ---------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def readers() -> Mapping[str, Reader]:
    """Every reader of what a model or a stranger wrote, by name."""
    import numpy as np  # noqa: F401 (before the clock runs)

    from agents.expert.model_places import named_places
    from agents.expert.recorded_replies import split_speech
    from agents.expert.writers.replies import EchoCheck, quoted, read_thought
    from agents.scripted.searcher.instruction import parse_instruction
    from agents.vlm.chat import Reply
    from agents.vlm.clients.chat_completions import error_text, read_completion, reply_of
    from agents.vlm.clients.failures import refusal_of
    from agents.vlm.matching import Matcher
    from agents.vlm.parsing import parse
    from agents.vlm.redaction import Secrets
    from agents.vlm.reply_causes import causes_of
    from agents.vlm.settings import Matching
    from benchmarks.monitor.formats import brief, visible
    from er_gym.data.critic import LONGEST_WORD, check
    from er_gym.data.knowledge import Knowledge
    from er_gym.data.mentions import find_mentions, named_in
    from er_gym.data.parse_conversation import language_of, thoughts_of, user_message
    from er_gym.data.sharegpt_report import decision
    from er_gym.data.trajectory import Subgoal
    from er_gym.data.words import count_words, sentences
    from er_gym.envs import actions
    from er_gym.tasks.paraphrase import usable

    matcher = Matcher(Matching())
    own = EchoCheck.against(["Say what you see and where you go, in one or two sentences."])
    secrets = Secrets("sk-0123456789abcdef", "http://u:p@h/v1?key=0123456789abcdef")

    def knowledge(language: Any) -> Knowledge:
        return Knowledge(
            language=language,
            instruction="Put the Apple into the Fridge.",
            turn=1,
            view=(),
            held="Apple",
            at="CounterTop",
            decision=actions.Action("navigate to", "Fridge"),
            purpose="search",
            subgoal=Subgoal(),
        )

    def answered(text: str) -> object:
        message = {"content": text, "reasoning": text}
        body = json.dumps({"choices": [{"message": message}]}).encode()
        try:
            reply = reply_of(read_completion(body))
        except ValueError:  # as it says
            return None
        return causes_of(reply, parse(reply.text, decide="json"))

    return {
        "a reply": parse,
        "a tool call": lambda text: parse("", text),
        "a reply in JSON": lambda text: parse(text, decide="json"),
        "a name": matcher.match,
        "an answer": answered,
        "an error": lambda text: error_text(text.encode("utf-8", "replace")),
        "a refusal": refusal_of,
        "secrets": secrets.redact,
        "an action": actions.parse,
        "an imported reply": lambda text: thoughts_of(text, "en", first=True),
        "an imported reply in Chinese": lambda text: thoughts_of(text, "zh", first=False),
        "an imported first message": lambda text: user_message(text, first=True, shows=True),
        "an imported message": lambda text: user_message(text, first=False, shows=True),
        "an imported decision": decision,
        "a language": language_of,
        "speech": lambda text: split_speech(text, "", "en"),
        "speech in Chinese": lambda text: split_speech(text, "", "zh"),
        "mentions": find_mentions.__wrapped__,
        "names in an instruction": named_in.__wrapped__,
        "words": count_words,
        "sentences": sentences,
        "a thought": lambda text: check(text, "reasoning", knowledge("en"), limit=10),
        "a thought of the greatest length": lambda text: check(
            text[: LONGEST_WORD * 60], "reasoning", knowledge("en"), limit=60
        ),
        "a thought of the greatest length in Chinese": lambda text: check(
            text[: LONGEST_WORD * 60], "planning", knowledge("zh"), limit=60
        ),
        "a written thought": lambda text: read_thought(Reply(text), "reasoning", 60),
        "an echo": own.refusals,
        "a quotation": lambda text: quoted(Reply(text)),
        "places": lambda text: named_places(text, ["Fridge", "CounterTop"]),
        "a paraphrase": lambda text: usable(text, "Find the Apple.", ["Apple"]),
        "an instruction": parse_instruction.__wrapped__,
        "a text of a page": visible,
        "a line of a page": brief,
    }


# -- budgets ---------------------------------------------------------------------------------------


class TooLong(Exception):
    """The processor time is over."""


def seconds_for(read: Reader, text: str, most: float = _MOST_SECONDS) -> float:
    """The processor time of a reader; call it in the main thread.

    Raises:
        TooLong: it takes more than ``most`` seconds.
    """

    def over(signum: int, frame: FrameType | None) -> None:
        raise TooLong

    before = signal.signal(signal.SIGPROF, over)
    began = time.process_time()
    signal.setitimer(signal.ITIMER_PROF, most)
    try:
        read(text)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
    return time.process_time() - began


def lines_for(read: Reader, text: str) -> int:
    """How many lines of Python a reader runs."""
    count = 0

    def trace(frame: FrameType, event: str, argument: object) -> Any:
        nonlocal count
        count += event == "line"
        return trace

    before = sys.gettrace()
    sys.settrace(trace)
    try:
        read(text)
    finally:
        sys.settrace(before)
    return count


def slow(
    read: Reader, length: int = LONG, most: float = _MOST_SECONDS, *, framed: bool = True
) -> Iterator[Try]:
    """Whether a reader takes more than its processor time for a text, or raises an error."""
    for name, text in texts(length, framed=framed):
        yield name, _slow(read, text, most)


def _slow(read: Reader, text: str, most: float) -> Iterator[str]:
    try:
        seconds_for(read, text, most)
    except TooLong:
        yield f"more than {most:g} s for {len(text):,} characters"
    except Exception as error:  # a reader of strangers' texts raises nothing
        yield f"{type(error).__name__}: {str(error)[:100]}"


def growing(read: Reader, length: int = _SHORT, *, framed: bool = True) -> Iterator[Try]:
    """Whether a reader runs more lines than in proportion for a text."""
    shorter, longer = texts(length, framed=framed), texts(2 * length, framed=framed)
    for (name, once), (_, twice) in zip(shorter, longer, strict=True):
        yield name, _growing(read, once, twice)


def _growing(read: Reader, once: str, twice: str) -> Iterator[str]:
    first, second = lines_for(read, once), lines_for(read, twice)
    if second > _MOST_GROWTH * first + _FEW_LINES:
        yield f"{first:,} lines, and {second:,} for a text twice as long"


def check(words: Sequence[str] = (), *, framed: bool = True) -> Tally:
    """Try the readers whose names hold the words, and print the failures.

    If the texts are not to be ``framed``, there are fewer, and nothing stands around them.
    """
    return tally("long texts", _tries(words, framed))


def _tries(words: Sequence[str], framed: bool) -> Iterator[Try]:
    for reader, read in readers().items():
        if has_words(reader, words):
            read("Put the Apple into the Fridge.")  # what is loaded once is loaded now
            grows = () if reader in BOUNDED else growing(read, framed=framed)
            for name, problems in (*grows, *slow(read, framed=framed)):
                yield f"{reader}, {name}", problems


if __name__ == "__main__":
    run_check(check, __doc__)
