"""Reads a verb and an object's name from the text of a decision."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass

from agents.vlm.parsing.json_objects import JsonObject, fields_in, objects_in
from agents.vlm.parsing.names import clean_name, look_up
from agents.vlm.parsing.placing import receptacle_in
from agents.vlm.parsing.rules import RULES
from agents.vlm.parsing.vocabulary import (
    ALONE,
    EDGES,
    HELD_FIELDS,
    MAYBE_PLACE_FIELDS,
    OBJECT_FIELDS,
    PLACE_FIELDS,
    THOUGHT_TAGS,
    VERB_FIELDS,
    VERBS,
    normalized,
)
from er_gym.tasks import verbs

FENCE = "```"
MOST = 20
"""The most lines, or JSON objects, that are tried."""
_LONGEST_LINE = 300


@dataclass(frozen=True)
class ParsedAction:
    """The action of a decision.

    Attributes:
        verb: a canonical verb; "" for none.
        name: the object's name as written; "" for none.
        rules: the rules that were needed to read it.
    """

    verb: str
    name: str = ""
    rules: tuple[str, ...] = ()


# -- a line ----------------------------------------------------------------------------------------

_REWRITES = tuple((rule.name, rule.rewrite) for rule in RULES if rule.rewrite)
_BY_PLAIN = {normalized(phrase): phrase for phrase in VERBS}


def _any_of(phrases: list[str]) -> str:
    """A pattern for phrases with their words joined in any way, longest phrase first."""
    longest_first = sorted(phrases, key=len, reverse=True)
    return "|".join(phrase.replace(" ", r"[\s_-]{0,3}") for phrase in longest_first)


_OURS = _any_of([phrase for phrase in VERBS if phrase.isascii()])
_THEIRS = _any_of([phrase for phrase in VERBS if not phrase.isascii()])
_VERB = re.compile(
    # After Latin letters the word must end, or a capital must begin the next.
    rf"\s*(?:((?i:{_OURS}))(?:(?![A-Za-z0-9])|(?<=[a-z])(?=[A-Z]))|({_THEIRS}))"
)
_PARTICLE = re.compile(r"[a-z]+ (?:up|down|on|off|out|away|over)")
_PARTED: tuple[tuple[str, str, re.Pattern[str]], ...] = (
    (
        "verb parted",
        verbs.TOGGLE,
        re.compile(r"(?:turn|switch|toggle|power)\s(?P<name>\S.*?)\s(?:on|off)\W*$", re.IGNORECASE),
    ),
    (
        "verb parted",
        verbs.PICKUP,
        re.compile(
            r"(?:pick|take)\s(?P<name>\S.*?)\s(?:up|out)"
            r"(?:\s(?:from|off|of|in|on|inside|and)\s.*|\W*)$",
            re.I,
        ),
    ),
    (
        "verb parted",
        verbs.TOGGLE,
        re.compile(r"(?:关掉|[开关](?![闭上启关掉]))(?P<name>\w{0,6}灯)\W*$"),
    ),
    (
        "verb parted",
        verbs.PICKUP,
        re.compile(r"从.{1,20}?(?:拿起|拿出|取出|拿取|捡起|拿)(?P<name>.+)"),
    ),
    *(
        ("verb parted", verb.name, re.compile(rf"{first}\s(?P<name>\S.*?)\s{last}\W*$", re.I))
        for verb in verbs.ADDED
        for first, last in (phrase.split() for phrase in verb.said if _PARTICLE.fullmatch(phrase))
        if not verb.alone
    ),
    *(
        ("verb parted", verb, re.compile(rf"[把将](?P<name>.+?)(?:{phrase})(?:起来|了)?\W*$"))
        for phrase, verb in sorted(VERBS.items(), key=lambda row: -len(row[0]))
        if verb in verbs.OBJECT_VERBS and not phrase.isascii()
    ),
)
"""Verbs whose words surround a name: the rule, the verb, and the pattern."""
_DOERS = frozenset(
    {"act", "step", "do", "execute", "executeaction", "perform", "action", "takeaction"}
)
_CALL = re.compile(
    r"\s*(?:[a-z_]{1,20}\.){0,2}([A-Za-z][A-Za-z_ -]{0,40})(?:\(|(?<=[a-z])\[)(.*?)[)\]]?\W*$"
)
_NAMED = re.compile(r"\s*(\w+)\s?=\s?")


def read_line(line: str) -> ParsedAction:
    """Read a verb and a name from a line; no verb if the line is not an action."""
    narrow = unicodedata.normalize("NFKC", line[:_LONGEST_LINE])
    needed = [] if narrow == line[:_LONGEST_LINE] else ["full width"]
    line = " ".join(narrow.split())
    if words := _called(line):
        return ParsedAction(words.verb, words.name, (*needed, *words.rules))
    for name, rewrite in _REWRITES:
        changed = rewrite(line)
        if changed != line:
            needed.append(name)
            line = changed
    words = _called(line) or _parted(line) or _said(line)
    return ParsedAction(words.verb, words.name, (*needed, *words.rules))


def _called(line: str) -> ParsedAction | None:
    """``navigate_to("Fridge")``, ``act(action="open", object="Fridge")``."""
    call = _CALL.match(line)
    if call is None:
        return None
    if (inner := _quoted_action(call)) is not None:
        return inner
    said = normalized(call[1])
    phrase = _BY_PLAIN.get(said) or _BY_PLAIN.get(said.replace("object", ""), "")
    if "=" in call[2] and call[1].isidentifier():
        fields = fields_in(_NAMED.sub(r" \1: ", call[2]))
        words = read_fields({**fields, VERB_FIELDS[0]: phrase})
        several = words.verb == verbs.PUT and len(fields) > 1  # and none is a known place
        if words.name or words.verb in verbs.BARE_VERBS or several:
            return ParsedAction(words.verb, words.name, ("call form", *words.rules))
    if not phrase:
        return None
    # Without names: what is put comes before what it is put in.
    verb = VERBS[phrase]
    given = [_NAMED.sub("", each, count=1) for each in call[2].split(",") if each.strip(EDGES)]
    name, rules = clean_name(given[-1 if verb == verbs.PUT else 0]) if given else ("", ())
    if verb in verbs.BARE_VERBS:
        name, rules = "", ("words after",) if name else ()
    return ParsedAction(verb, name, ("call form", *(rule for rule in rules if rule != "marks")))


def _quoted_action(call: re.Match[str]) -> ParsedAction | None:
    """``env.step("open Fridge")``, ``act("put in", "Fridge")``: the action is what is given."""
    if normalized(call[1]) not in _DOERS or "=" in call[2]:
        return None
    said = " ".join(call[2].replace(",", " ").replace('"', " ").replace("'", " ").split())
    words = _parted(said) or _said(said)
    return ParsedAction(words.verb, words.name, ("call form", *words.rules)) if words.verb else None


def _parted(line: str) -> ParsedAction | None:
    spaced = line.replace("_", " ")  # of the same length, so that names can be had as written
    if put := receptacle_in(line):
        what, name, more = put
        rule = "put form"
        if f"{spaced} ".casefold().startswith("put in ") and not what:
            rule = "" if spaced == line else "verb spelling"
        return ParsedAction(verbs.PUT, name, (*filter(None, [rule]), *more))
    for rule, verb, pattern in _PARTED:
        if found := pattern.match(spaced):
            name, more = clean_name(line[slice(*found.span("name"))])
            return ParsedAction(verb, name, (rule, *more))
    return None


def _said(line: str) -> ParsedAction:
    """A verb, then the name."""
    found = _VERB.match(line)
    if found is None:
        return ParsedAction("")
    said, rest = found[0].strip(), line[found.end() :]
    phrase = _BY_PLAIN[normalized(said)]
    verb = VERBS[phrase]
    rules: tuple[str, ...] = ()
    if " ".join(said.casefold().split()) != verb:
        spelt = normalized(verb).startswith(normalized(said))  # "put" and "navigate" are cut short
        rules = ("verb spelling" if spelt else "verb synonym",)
    if verb in verbs.BARE_VERBS:
        after = [normalized(word) for word in rest.split() if normalized(word)]
        if phrase in ALONE and not ALONE[phrase].issuperset(after):
            return ParsedAction("")
        more = ("words after",) if after else ("marks",) if rest.strip() else ()
        return ParsedAction(verb, rules=(*rules, *more))
    name, needed = clean_name(rest)
    if phrase in _ON_OR_OPEN and _only_toggles(name):
        verb = verbs.TOGGLE
    return ParsedAction(verb, name, (*rules, *needed))


_ON_OR_OPEN = frozenset({"打开", "关闭", "关上"})
"""Chinese phrases for "open" or "close" that are also those for "switch on" or "switch off"."""


def _only_toggles(name: str) -> bool:
    """Whether a thing of this name can be switched, but not opened."""
    entry, opens, toggles = look_up(name), *map(verbs.verb_named, (verbs.OPEN, verbs.TOGGLE))
    return entry is not None and all(
        toggles.takes(each) and not opens.takes(each) for each in entry.types
    )


# -- a decision ------------------------------------------------------------------------------------

_NEXT_ACTION = re.compile(
    r"[\n;；]|\.?\s(?:and )?then\s|\s?(?:->|=>|→)\s?|\s\d{1,2}[.)、]\s|然后|[,，。]再", re.I
)


_ARROW = re.compile(
    r"^(?P<what>\W{0,9}(?:put|place|move)\b[^\n>→-]{1,80})(?:->|=>|→)\s?(?P<name>[^\n>→-]{1,40})$",
    re.IGNORECASE | re.MULTILINE,
)
_LONGEST_DECISION = 20_000


def _put_into(found: re.Match[str]) -> str:
    """``put Apple -> Fridge`` is one action if a name follows the arrow."""
    name = clean_name(found["name"])[0]
    return f"{found['what']} into {found['name']}" if look_up(name) else found[0]


def _unfenced(text: str) -> str:
    """The content of the last code fence that is not empty; the text itself if there is none."""
    inside = [
        # A word alone in the first line says which language it is.
        re.sub(r"\A(?:\w{1,12}\n|json\b|text\b)", "", block.lstrip(" ")).strip()
        for block in text.split(FENCE)[1::2]
    ]
    return next((block for block in reversed(inside) if block), text.replace(FENCE, "").strip())


def read_decision(text: str) -> ParsedAction:
    """Read a verb and a name from the text of a decision; no verb if it is not an action."""
    needed: tuple[str, ...] = ()
    if FENCE in text:
        needed, text = ("code fence",), _unfenced(text)
    if found := find_fields(text):
        words = read_fields(found.fields)
        return ParsedAction(words.verb, words.name, (*needed, "json", *words.rules))
    text = _ARROW.sub(_put_into, text[:_LONGEST_DECISION])
    lines = [line for line in _NEXT_ACTION.split(text) if line.strip(EDGES)]
    for number, line in enumerate(lines[:MOST]):
        words = read_line(line)
        if words.verb in verbs.OBJECT_VERBS and not words.name and len(lines) > number + 1:
            following = read_line(f"{line} {lines[number + 1]}")  # the name is in the next line
            words = following if look_up(following.name) else words
        if words.verb:
            more = ("several actions",) if len(lines) > 1 else ()
            return ParsedAction(words.verb, words.name, (*needed, *more, *words.rules))
    return ParsedAction("", rules=needed)


def find_fields(text: str) -> JsonObject | None:
    """The last JSON object or list of objects with an action, else the last with a field for
    one."""
    found = objects_in(text, MOST)
    found = [each for each in found if not each.fields.keys().isdisjoint(VERB_FIELDS)]
    read = (each for each in reversed(found) if read_fields(each.fields).verb)
    return next(read, found[-1] if found else None)


def read_fields(fields: Mapping[str, str]) -> ParsedAction:
    """Read a verb and a name from the fields of a JSON object."""
    for field in VERB_FIELDS:
        words = read_line(fields.get(field, ""))
        if not words.verb:
            continue
        order = (*PLACE_FIELDS, *OBJECT_FIELDS)
        if words.verb != verbs.PUT:
            order = (*OBJECT_FIELDS, *PLACE_FIELDS)
        elif _place_is_unclear(fields, field, words):
            return ParsedAction(words.verb, "", words.rules)
        names = (_field_name(fields.get(name, "")) for name in order if name != field)
        name, rules = next((found for found in names if found[0]), ("", ()))
        if words.verb in verbs.BARE_VERBS:
            return ParsedAction(words.verb, "", (*words.rules, *(("words after",) if name else ())))
        if words.name:
            return words
        return ParsedAction(words.verb, name, (*words.rules, *rules))
    return ParsedAction("")


_LONGEST_NAME = 40
_NO_PLACE = {*VERB_FIELDS, *THOUGHT_TAGS, *HELD_FIELDS} - {*OBJECT_FIELDS}


_PREPOSITION = re.compile(
    r"\A(?:in|on)(?:to|side(?: of)?|\s?/\s?(?:in|on)| top of)?\s", re.IGNORECASE
)


def _field_name(value: str) -> tuple[str, tuple[str, ...]]:
    """The name in a field such as ``"where": "in the Fridge"``."""
    return clean_name(_PREPOSITION.sub("", value.lstrip(), count=1))


def _place_is_unclear(fields: Mapping[str, str], verb_field: str, words: ParsedAction) -> bool:
    """Whether fields to put something name several types, and none of the fields says that it is
    the place: one of them is what is put."""
    places = [name for name in PLACE_FIELDS if _field_name(fields.get(name, ""))[0]]
    if words.name:  # "put Bowl" with "in": "Fridge"
        said_where = "put form" in words.rules or MAYBE_PLACE_FIELDS.issuperset(places)
        values = [] if said_where else [words.name, *(fields[name] for name in places)]
    elif places:
        return False
    else:
        values = [
            value for name, value in fields.items() if name != verb_field and name not in _NO_PLACE
        ]
    found = (look_up(_field_name(each)[0]) for each in values if len(each) <= _LONGEST_NAME)
    return len({entry.types for entry in found if entry}) > 1
