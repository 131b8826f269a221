"""A small grammar of wordings: rules with alternatives, filled from facts.

A rule is a block of lines in a YAML file; each line is an alternative. In a line,

- ``[a|b|]`` is one of several texts, perhaps an empty one;
- ``{name}`` is a rule, or a fact in words; ``{name?}`` is a rule that may be left out;
- ``{form:fact}`` is a fact in a form of :class:`~agents.expert.writers.nouns.Nouns`, such as
  ``{the:thing}``;
- ``{some:pool}`` lists two or three things of a pool that were not mentioned yet;
- ``{rule@pool}`` takes a thing of a pool that was not mentioned yet, and fills the rule with its
  facts;
- ``{?fact}`` and ``{!fact}`` say that the line needs a fact, or must not have it.

A line is skipped if a fact or pool that it needs is missing. A line that the same writing has used
already is used again only if there is no other. A line that begins with ``~`` is used only if no
other can be. A rule can be a mapping instead, ``by`` with the name of a fact and a block for each
of its values; the value ``else`` stands for all others, and for those whose lines cannot be filled.
"""

from __future__ import annotations

import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, TypeAlias

from agents.expert.writers.nouns import Nouns
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import read_yaml

Facts: TypeAlias = Mapping[str, Any]
"""A fact is an object type or another text, a flag, the facts of one thing, or a pool: a tuple of
such."""
_TOKEN = re.compile(r"[\[|\]]|\{[^{}]*\}|[^\[|\]{}]+")
_SENTENCE_END = re.compile(r"[.?!。？！]")
_MOST_LISTED = 3


class Missing(Exception):
    """A line cannot be filled from the facts."""


@dataclass
class Writing:
    """The state of a piece of writing.

    Attributes:
        rules: the grammar.
        nouns: the words for object types.
        random: makes all choices.
        fullness: the probability of an optional part, 0 to 1.
        used: the lines used so far; they are used again only if there are no others.
        mentioned: the object types taken from pools so far.
    """

    rules: Mapping[str, Rule | Table]
    nouns: Nouns
    random: random.Random
    fullness: float = 0.5
    used: set[int] = field(default_factory=set)
    mentioned: set[str] = field(default_factory=set)

    def write(self, rule: str, facts: Facts) -> str:
        """The text of a rule.

        Raises:
            Missing: none of its lines can be filled from the facts.
        """
        return self.rules[rule].write(self, facts)


@dataclass(frozen=True)
class _Text:
    text: str

    def write(self, writing: Writing, facts: Facts) -> str:
        if _SENTENCE_END.search(self.text):
            writing.nouns.end_sentence()
        return self.text


@dataclass(frozen=True)
class _Guard:
    fact: str
    wanted: bool

    def write(self, writing: Writing, facts: Facts) -> str:
        if bool(facts.get(self.fact)) is not self.wanted:
            raise Missing(self.fact)
        return ""


@dataclass(frozen=True)
class _Name:
    """A rule, or a fact in words."""

    name: str

    def write(self, writing: Writing, facts: Facts) -> str:
        if self.name in writing.rules:
            return writing.rules[self.name].write(writing, facts)
        return writing.nouns.word(_fact(facts, self.name), "", writing.random)


@dataclass(frozen=True)
class _Form:
    form: str
    fact: str

    def write(self, writing: Writing, facts: Facts) -> str:
        return writing.nouns.word(_fact(facts, self.fact), self.form, writing.random)


@dataclass(frozen=True)
class _List:
    """Two or three things of a pool, in a form."""

    form: str
    pool: str
    least: int = 1

    def write(self, writing: Writing, facts: Facts) -> str:
        pool = _fact(facts, self.pool)
        fresh = [each for each in pool if each["o"] not in writing.mentioned]
        if len(fresh) < self.least:
            raise Missing(self.pool)
        most = writing.random.randint(min(2, len(fresh)), min(_MOST_LISTED, len(fresh)))
        chosen = fresh[:most]
        writing.mentioned.update(each["o"] for each in chosen)
        nouns = writing.nouns
        words = [
            nouns.counted(each, writing.random)
            if self.form == "a"
            else nouns.word(each["o"], self.form, writing.random)
            for each in chosen
        ]
        if len(words) > 1:
            nouns.end_list()
        return nouns.joined(words)


@dataclass(frozen=True)
class _Scope:
    """A rule, filled with the facts of one thing."""

    rule: str
    pool: str

    def write(self, writing: Writing, facts: Facts) -> str:
        pool = _fact(facts, self.pool)
        rule = writing.rules[self.rule]
        if isinstance(pool, Mapping):
            return rule.write(writing, {**facts, **pool})
        for each in pool:
            if each["o"] not in writing.mentioned:
                try:
                    text = rule.write(writing, {**facts, **each})
                except Missing:
                    continue
                writing.mentioned.add(each["o"])
                return text
        raise Missing(self.pool)


@dataclass(frozen=True)
class _Perhaps:
    part: _Part

    def write(self, writing: Writing, facts: Facts) -> str:
        if writing.random.random() >= writing.fullness:
            return ""
        try:
            return self.part.write(writing, facts)
        except Missing:
            return ""


@dataclass(frozen=True)
class _Line:
    parts: tuple[_Part, ...]
    is_last_resort: bool = False

    def write(self, writing: Writing, facts: Facts) -> str:
        return "".join([part.write(writing, facts) for part in self.parts])


@dataclass(frozen=True)
class Rule:
    """Lines of which one is chosen."""

    lines: tuple[_Line, ...]

    def write(self, writing: Writing, facts: Facts) -> str:
        """The text of the first line, in a random order, that can be filled."""
        order = writing.random.sample(self.lines, len(self.lines))
        if len(order) > 1:
            order.sort(key=lambda line: (line.is_last_resort, id(line) in writing.used))
        for line in order:
            mentioned, nouns = set(writing.mentioned), writing.nouns
            mark = nouns.mark()
            try:
                text = line.write(writing, facts)
            except Missing:
                writing.mentioned = mentioned
                nouns.go_back(mark)
                continue
            writing.used.add(id(line))
            return text
        raise Missing("no line can be filled")


@dataclass(frozen=True)
class Table:
    """Rules, one for each value of a fact."""

    by: str
    rows: Mapping[str, Rule]

    def write(self, writing: Writing, facts: Facts) -> str:
        """The text of the rule for the fact's value."""
        rule = self.rows.get(facts.get(self.by, ""))
        others = self.rows.get("else")
        if rule is not None:
            try:
                return rule.write(writing, facts)
            except Missing:
                if others is None:
                    raise
        if others is None:
            raise Missing(self.by)
        return others.write(writing, facts)


_Part: TypeAlias = _Text | _Guard | _Name | _Form | _List | _Scope | _Perhaps | Rule
_LISTS = {"some": _List("a", ""), "all": _List("the", "", 2), "several": _List("a", "", 2)}


@lru_cache(maxsize=4)
def grammar(language: str) -> Mapping[str, Rule | Table]:
    """The rules of a language, read from ``configs/thoughts/LANGUAGE/*.yaml``.

    Raises:
        ValueError: a rule is there twice, or a line is malformed or names no rule and no fact.
        TaskFileError: a file is not YAML.
    """
    folder = config_directory("thoughts") / language
    rules: dict[str, Rule | Table] = {}
    for file in sorted(folder.glob("*.yaml")):
        if file.stem == "names":
            continue
        for name, value in read_yaml(file).items():
            if name in rules:
                raise ValueError(f"{file}: the rule {name!r} is in two files; rename one")
            rules[name] = _parsed_rule(value, f"{file}: {name}")
    if not rules:
        raise ValueError(f"{folder} holds no wordings; the languages are en and zh")
    return rules


def _parsed_rule(value: object, where: str) -> Rule | Table:
    if isinstance(value, str):
        return Rule(
            tuple(parse(line.strip(), where) for line in value.splitlines() if line.strip())
        )
    if not (isinstance(value, Mapping) and isinstance(value.get("by"), str)):
        raise ValueError(
            f"{where}: a rule is a block of lines, or a mapping with 'by'; got {value!r:.80}"
        )
    rows: dict[str, Rule] = {}
    for key, lines in value.items():
        if isinstance(key, bool):
            raise ValueError(f"{where}: YAML reads a key as {key}; put on and off in quotes")
        if key != "by":
            row = _parsed_rule(lines, f"{where}: {key}")
            assert isinstance(row, Rule)
            rows.update(dict.fromkeys(map(str.strip, str(key).split(",")), row))
    return Table(value["by"], rows)


def parse(line: str, where: str = "a line") -> _Line:
    """Parse an alternative of a rule.

    Raises:
        ValueError: a bracket is not closed.
    """
    text = line.removeprefix("~").lstrip()
    tokens = _TOKEN.findall(text)
    if "".join(tokens) != text:
        raise ValueError(f"{where}: a brace is not closed in {line!r}")
    parsed, rest = _parsed(tokens, 0, where, line)
    if rest != len(tokens):
        raise ValueError(f"{where}: a bracket is closed that was not opened in {line!r}")
    return _Line(parsed.parts, text != line)


def _parsed(tokens: Sequence[str], at: int, where: str, line: str) -> tuple[_Line, int]:
    parts: list[_Part] = []
    while at < len(tokens) and tokens[at] not in ("|", "]"):
        token = tokens[at]
        at += 1
        if token == "[":
            choices = []
            while True:
                choice, at = _parsed(tokens, at, where, line)
                choices.append(choice)
                if at == len(tokens):
                    raise ValueError(f"{where}: a bracket is not closed in {line!r}")
                at += 1
                if tokens[at - 1] == "]":
                    break
            parts.append(Rule(tuple(choices)))
        elif token.startswith("{"):
            parts.append(_parsed_slot(token[1:-1]))
        else:
            parts.append(_Text(token))
    return _Line(tuple(parts)), at


def _parsed_slot(slot: str) -> _Part:
    if slot[:1] in ("?", "!"):
        return _Guard(slot[1:], slot[0] == "?")
    if slot.endswith("?"):
        return _Perhaps(_parsed_slot(slot[:-1]))
    if "@" in slot:
        rule, _, pool = slot.partition("@")
        return _Scope(rule, pool)
    if ":" in slot:
        form, _, fact = slot.partition(":")
        if form in _LISTS:
            return _List(_LISTS[form].form, fact, _LISTS[form].least)
        return _Form(form, fact)
    return _Name(slot)


def _fact(facts: Facts, name: str) -> Any:
    value = facts.get(name)
    if not value:
        raise Missing(name)
    return value
