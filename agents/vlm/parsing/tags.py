"""Splits a reply at its tags into thoughts, decisions and the text outside of tags."""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Iterable
from dataclasses import dataclass, field

from agents.vlm.parsing.vocabulary import (
    CALL_TAGS,
    DECISION,
    DECISION_TAGS,
    THINK,
    THOUGHT_TAGS,
    normalized,
)


@dataclass(frozen=True)
class Thought:
    """A thought of a reply; ``kind`` is one of the values of
    :data:`~agents.vlm.parsing.vocabulary.THOUGHT_TAGS`."""

    kind: str
    text: str


_TAG = re.compile(r"[<＜]\s{0,3}([/／\\]?)\s{0,3}([^\W\d_][\w -]{0,30})\s{0,3}[>＞]")


@dataclass(frozen=True)
class _Tag:
    """A known tag; ``kind`` is a kind of thought, or ``DECISION``."""

    start: int
    end: int
    closes: bool
    name: str
    kind: str
    written: str


@dataclass(frozen=True)
class TaggedDecision:
    """The content of a decision tag.

    Attributes:
        body: the text.
        before: the number of pieces of text outside of tags before it.
        rules: the rules that the tag needs.
    """

    body: str
    before: int
    rules: tuple[str, ...]


@dataclass
class TaggedReply:
    """A reply, split at its tags.

    Attributes:
        thoughts: the thoughts in tags.
        decisions: the decisions in tags; ``weighed``: those inside of ``<think>``.
        outside: the pieces of text outside of tags.
        last_open: the text after a last tag without an end tag.
        rules: the rules that the split needed.
    """

    thoughts: list[Thought] = field(default_factory=list)
    decisions: list[TaggedDecision] = field(default_factory=list)
    weighed: list[TaggedDecision] = field(default_factory=list)
    outside: list[str] = field(default_factory=list)
    last_open: str = ""
    rules: list[str] = field(default_factory=list)

    def all_thoughts(
        self, before: Iterable[str], more: tuple[Thought, ...] = ()
    ) -> tuple[Thought, ...]:
        """The thoughts in tags and ``more``; without any, the text before the decision."""
        if self.thoughts or more:
            return (*self.thoughts, *more)
        said = "\n".join(before).strip()
        return (Thought("Thinking", said),) if said else ()


def _tags(text: str) -> list[_Tag]:
    tags = []
    for found in _TAG.finditer(text):
        name = normalized(found[2])
        kind = DECISION if name in DECISION_TAGS | CALL_TAGS else THOUGHT_TAGS.get(name, "")
        if kind:
            closes = bool(found[1])
            tags.append(_Tag(found.start(), found.end(), closes, name, kind, found[0]))
    return tags


def split_at_tags(text: str) -> TaggedReply:
    """Split a reply at its tags, in time linear in its length."""
    tags = _tags(text)
    ends_of_thinking = [n for n, tag in enumerate(tags) if tag.closes and tag.name == THINK]
    layout = TaggedReply()
    at = number = 0
    while number < len(tags):
        tag = tags[number]
        if tag.closes:
            _end_without_start(layout, tag, text[at : tag.start])
            at, number = tag.end, number + 1
            continue
        layout.outside.append(text[at : tag.start])
        number += 1
        if tag.name == THINK:  # skip the tags inside, if it has an end
            later = bisect_left(ends_of_thinking, number)
            number = ends_of_thinking[later] if later < len(ends_of_thinking) else number
        end = tags[number] if number < len(tags) else None
        body = text[tag.end : end.start if end else len(text)]
        if end is not None and end.closes and end.kind == tag.kind:
            _add(layout, tag, end, body)
            at, number = end.end, number + 1
        else:
            _add(layout, tag, None, body)
            at = end.start if end else len(text)
            layout.last_open = "" if end or tag.kind == DECISION else body
    layout.outside.append(text[at:])
    return layout


def _add(layout: TaggedReply, tag: _Tag, end: _Tag | None, body: str) -> None:
    """Add the text after a tag; ``end`` is its end tag."""
    if not body.strip():
        return
    rules = [] if end else ["no end tag"]
    if tag.kind != DECISION:
        layout.rules += rules
        layout.thoughts.append(Thought(tag.kind, body.strip()))
        if tag.name == THINK and end:
            layout.weighed += split_at_tags(body).decisions
        return
    if tag.name in CALL_TAGS:
        rules.append("tool call")
    elif tag.written != f"<{DECISION}>" or (end and end.written != f"</{DECISION}>"):
        rules.append("tag spelling")
    layout.decisions.append(TaggedDecision(body, len(layout.outside), tuple(rules)))


def _end_without_start(layout: TaggedReply, tag: _Tag, body: str) -> None:
    """Add the text between an end tag without a start tag and the tag before it."""
    if not body.strip():
        return
    if tag.kind == DECISION:
        *lines, last = filter(str.strip, body.splitlines())
        layout.outside.append("\n".join(lines))
        spelling = () if tag.written == f"</{DECISION}>" else ("tag spelling",)
        rules = ("no start tag", *spelling)
        layout.decisions.append(TaggedDecision(last, len(layout.outside), rules))
        return
    layout.rules.append("no start tag")
    if tag.name == THINK:  # the chat template wrote <think>: everything so far is thinking
        body = "\n".join((*layout.outside, body))
        layout.outside.clear()
        layout.weighed += layout.decisions
        layout.decisions.clear()
    layout.thoughts.append(Thought(tag.kind, body.strip()))
