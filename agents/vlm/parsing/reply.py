"""Reads a model's reply as a decision and the thoughts before it.

The normal form is ``<Observation>…</Observation><Planning>…</Planning><DecisionMaking>navigate to
Fridge</DecisionMaking>``; or, if the settings ask for it, a tool call or a JSON object. Models
deviate from it in many ways. :data:`agents.vlm.parsing.rules.RULES` lists the deviations that are
understood, and the result names the rules that a reply needed. The parser guesses nothing beyond
these rules: for any other reply it returns a problem, worded for the model.

If a reply decides several times, the last decision counts, because models weigh options before they
choose. If one decision has several actions, the first counts, because actions are done in order.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from agents.vlm.parsing.decision import (
    FENCE,
    MOST,
    ParsedAction,
    find_fields,
    read_decision,
    read_fields,
)
from agents.vlm.parsing.function_tags import tagged_calls
from agents.vlm.parsing.json_objects import JsonObject
from agents.vlm.parsing.rules import RULES, label
from agents.vlm.parsing.tags import TaggedDecision, TaggedReply, Thought, split_at_tags
from agents.vlm.parsing.vocabulary import THOUGHT_TAGS, VERB_FIELDS
from er_gym.tasks import verbs

LONGEST = 200_000
"""Only this many characters at the end of a reply are read."""
_LONGEST_BARE, _LONGEST_BARE_LINE = 8, 120
"""The most words and characters of an action without tags and label."""
_LONGEST_LABELLED = 1_000
_LONGEST_QUOTE = 60
_EXAMPLE = f"'{verbs.NAVIGATE} Fridge'"


@dataclass(frozen=True)
class ParsedReply:
    """A parsed reply.

    Attributes:
        verb: a canonical verb, see :mod:`er_gym.tasks.verbs`; "" if there is a problem.
        name: the model's name for the object, as written; "" for a verb without an object.
        thoughts: in order. Text outside of tags counts as a thought if no tags hold any.
        rules: the names of the rules that were needed, in the order of
            :data:`~agents.vlm.parsing.rules.RULES`.
        problem: what is wrong and what to write instead; "" if there is a verb.
    """

    verb: str = ""
    name: str = ""
    thoughts: tuple[Thought, ...] = ()
    rules: tuple[str, ...] = ()
    problem: str = ""


def parse(
    text: str, call: str = "", decide: Literal["tags", "tools", "json"] = "tags"
) -> ParsedReply:
    """Parse a reply. No reply raises an error.

    Args:
        text: the reply's text.
        call: the arguments of a tool call as JSON; "" without a call. It takes precedence over the
            text.
        decide: the form that the model was asked for. With ``json``, a text that is a JSON object
            needs no rule; nothing else depends on it.
    """
    layout = split_at_tags(tagged_calls(text[-LONGEST:]))
    if len(text) > LONGEST:
        layout.rules.append("long")
    chosen = _chosen(layout, call[-LONGEST:])
    if chosen is None:
        problem = "has no decision" if text.strip() else "is empty"
        return ParsedReply(
            thoughts=layout.all_thoughts(layout.outside),
            rules=_in_order(layout.rules),
            problem=f"The reply {problem}. Decide on one action, such as {_EXAMPLE}.",
        )
    words = chosen.words
    rules = [*layout.rules, *chosen.rules, *words.rules]
    if _is_json(call) if call.strip() else decide == "json" and _is_json(text):
        rules = [rule for rule in rules if rule != "json"]
    problem = _problem(words, chosen.said)
    return ParsedReply(
        verb="" if problem else words.verb,
        name="" if problem else words.name,
        thoughts=layout.all_thoughts(chosen.before, chosen.thoughts),
        rules=_in_order(rules),
        problem=problem,
    )


def _in_order(rules: Iterable[str]) -> tuple[str, ...]:
    needed = {*rules}
    return tuple(rule.name for rule in RULES if rule.name in needed)


def _problem(words: ParsedAction, said: str) -> str:
    """The feedback for an unusable decision; "" for a usable one."""
    if not words.verb:
        said = " ".join(said[: 4 * _LONGEST_QUOTE].split())
        quote = said if len(said) <= _LONGEST_QUOTE else said[: _LONGEST_QUOTE - 1] + "…"
        return (
            f"'{quote}' is not an action. Actions with an object: "
            f"{', '.join(verbs.OBJECT_VERBS)}; without one: {', '.join(verbs.BARE_VERBS)}. Write "
            "one, such as "
            f"{_EXAMPLE}."
        )
    if words.verb in verbs.OBJECT_VERBS and not words.name:
        return f"'{words.verb}' needs an object. Name one, such as in '{words.verb} Fridge'."
    return ""


# -- finding the decision --------------------------------------------------------------------------


@dataclass(frozen=True)
class _Chosen:
    """The decision that counts.

    Attributes:
        words: its action.
        said: its text as written.
        before: the text outside of tags that precedes it.
        rules: the rules that were needed to find it.
        thoughts: the thoughts given with it.
    """

    words: ParsedAction
    said: str
    before: Iterable[str] = ()
    rules: tuple[str, ...] = ()
    thoughts: tuple[Thought, ...] = ()


def _chosen(layout: TaggedReply, call: str) -> _Chosen | None:
    """The decision of a reply, readable or not."""
    if call.strip():
        return _from_call(call, layout)
    if layout.decisions:
        return _from_tags(layout.decisions, layout.outside)
    outside = _from_outside(layout.outside)
    if outside and outside.words.verb:
        return outside
    last_resort = (
        _from_tags(layout.weighed, ()) if layout.weighed else _from_outside([layout.last_open])
    )
    if last_resort:
        return outside or replace(last_resort, rules=(*last_resort.rules, "in thoughts"))
    return outside


def _from_call(call: str, layout: TaggedReply) -> _Chosen:
    found = find_fields(call)
    thoughts = _thoughts_in(found) if found else ()
    return _Chosen(read_decision(call), call, layout.outside, thoughts=thoughts)


def _is_json(text: str) -> bool:
    try:
        return isinstance(json.loads(text), dict)
    except (ValueError, RecursionError):
        return False


def _from_tags(decisions: Sequence[TaggedDecision], outside: Sequence[str]) -> _Chosen:
    last = decisions[-1]
    several = len({" ".join(each.body.split()) for each in decisions}) > 1
    rules = (*last.rules, *(("several decisions",) if several else ()))
    return _Chosen(read_decision(last.body), last.body, outside[: last.before], rules)


def _from_outside(pieces: Sequence[str]) -> _Chosen | None:
    """Search text without tags: the first reader that finds an action counts, else the first that
    finds anything."""
    text = "\n".join(pieces)
    first = None
    for way in (_json_in, _labelled_in, _bare_in):
        found = way(text)
        if found and found.words.verb:
            return found
        first = first or found
    return first


def _json_in(text: str) -> _Chosen | None:
    found = find_fields(text)
    if found is None:
        return None
    before, fence, _ = text[: found.start].rpartition(FENCE)
    rules = ("json", "code fence") if fence else ("json",)
    return _Chosen(
        read_fields(found.fields),
        text[found.start :],
        [before if fence else text[: found.start]],
        rules,
        _thoughts_in(found),
    )


def _thoughts_in(found: JsonObject) -> tuple[Thought, ...]:
    """The fields of a JSON object that are named like thoughts."""
    return tuple(
        Thought(THOUGHT_TAGS[name], text)
        for name, text in found.fields.items()
        if name in THOUGHT_TAGS and text
    )


def _labelled_in(text: str) -> _Chosen | None:
    lines = text.splitlines()
    for number in range(len(lines) - 1, -1, -1):
        line = lines[number][:_LONGEST_LABELLED]
        if found := label(line):
            said = line[found.end() :]
            if not said.strip():  # a heading
                said = next(filter(str.strip, lines[number + 1 :]), "")
            said = _with_input(said, lines[number + 1 : number + 2])
            return _Chosen(read_decision(said), said, lines[:number], ("no tags",))
    return None


_INPUT = re.compile(r"[\W_]{0,4}action[ _]?input\W{0,4}[:：]\W{0,4}(.*)", re.IGNORECASE)


def _with_input(said: str, following: Sequence[str]) -> str:
    """``Action: put`` with the line ``Action Input: Fridge`` after it."""
    found = _INPUT.match(following[0][:_LONGEST_LABELLED]) if following else None
    if found is None:
        return said
    fields = find_fields(following[0])
    if fields is None:
        return f"{said.strip()} {found[1]}"
    return json.dumps({VERB_FIELDS[0]: said.strip(), **fields.fields})


def _bare_in(text: str) -> _Chosen | None:
    """The first of the final lines that consist of an action alone."""
    lines = [line for line in text.splitlines() if line.strip()]
    rules = ["no tags"]
    if any(line.lstrip().startswith(FENCE) for line in lines):
        lines = [line for line in lines if not line.lstrip().startswith(FENCE)]
        rules.append("code fence")
    actions: list[ParsedAction] = []
    for line in lines[: -1 - MOST : -1]:
        if len(line) > _LONGEST_BARE_LINE or len(line.split()) > _LONGEST_BARE:
            break
        words = read_decision(line)
        if not words.verb or "lead-in" in words.rules:
            break
        actions.append(words)
    if not actions:
        return None
    if len(actions) > 1:
        rules.append("several actions")
    first = len(lines) - len(actions)
    return _Chosen(actions[-1], lines[first], lines[:first], tuple(rules))
