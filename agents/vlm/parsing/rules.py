"""The deviations from the normal form of a reply that the parser accepts."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Rule:
    """A deviation from the normal form that the parser accepts.

    Attributes:
        name: as :class:`~agents.vlm.parsing.ParsedReply` lists it.
        about: what is accepted.
        rewrite: normalises a line of a decision, for rules that need nothing else. Rewrites are
            applied in the order of :data:`RULES`; a rule counts as needed if its rewrite changes
            the line.
    """

    name: str
    about: str
    rewrite: Callable[[str], str] | None = None


_LABEL = re.compile(
    r"[\W\d]{0,8}(?:(?:my|the|final|next|chosen)\s){0,2}"
    r"(?:decision[ _-]?making|decision|action|answer|command|决策|决定|行动|动作|下一步)"
    r"(?:\s(?:is\sto(?=\s)|is|to take))?[\s*_\])】]{0,4}(?:[:：]|(?<=[\])】*])|(?<=is\sto\s)|$)"
    r"[\s*_]{0,4}",
    re.IGNORECASE,
)
_LIST_MARK = re.compile(r"(?:[-+•]\s|#{1,6}\s|(?:step\s?)?\(?\d{1,2}[.):、]\s?)+", re.IGNORECASE)
_LEAD_IN = re.compile(
    r"(?:(?:since|because|as)\s[^,.;]{1,120},\s)?"
    r"(?:(?:so|now|next|then|first|finally|therefore|please|ok|okay),?\s)*"
    r"(?:(?:i|we)(?:\s(?:will|would like to|would|should|shall|must|can|choose to|decide to|"
    r"need to|want to|have to|am going to)|['’]ll|['’]d like to|['’]d|['’]m going to)\s|would\s|"
    r"let(?:\sme|\sus|['’]s)\s)?"
    r"(?:(?:now|first|next|then)\s)?(?:use\s)?"
    r"(?:go\s(?:and\s)?(?=(?:open|close|pick|grab|get|take|put|place|toggle|turn|switch|slice)\s))?"
    r"(?:(?:现在|接下来|下一步|首先|然后|因此),?)?(?:我们?(?:将|要|会|应该|需要|决定|选择)?|请|让我)?先?",
    re.IGNORECASE,
)
_MARKS = re.compile(
    # End-of-turn tokens, closing tags or parts of them, LaTeX's box, quotes and brackets.
    r"<\|[^<>|]{1,30}\|>|</\w{0,30}(?:>|$)|\\(?:boxed|text)(?!\w)"
    r"|[\[\]{}<>*$`\"“”「」『』《》【】]+|(?<!\w)['‘’]|['‘’](?!\w)"
)


def label(line: str) -> re.Match[str] | None:
    """Match the label before an action in a line such as ``**Action:** open Fridge``."""
    return _LABEL.match(line)


def _off_the_front(pattern: re.Pattern[str]) -> Callable[[str], str]:
    """A rewrite that removes a match at a line's beginning, unless nothing would be left."""

    def rewrite(line: str) -> str:
        found = pattern.match(line)
        return line[found.end() :].lstrip() or line if found else line

    return rewrite


def _without_marks(line: str) -> str:
    line = line.removeprefix("(") if line.startswith("(") else line
    return " ".join(_MARKS.sub(" ", line).split())


RULES: tuple[Rule, ...] = (
    Rule("long", "only the end of a very long reply is read"),
    Rule("no end tag", "a tag ends at the next tag, or at the end of the reply"),
    Rule("no start tag", "what stands before an end tag that has no start tag belongs to it"),
    Rule("tag spelling", "<Decision>, <Action>, <decision_making>, full-width brackets …"),
    Rule("tool call", "a tool call in the text: <tool_call>{…}</tool_call>"),
    Rule("several decisions", "the last of several decisions counts"),
    Rule("no tags", "'Action: …', or an action alone, in the last line of a reply without tags"),
    Rule("in thoughts", "the decision is among the thoughts, and nowhere else"),
    Rule("code fence", "``` around a decision"),
    Rule("json", "a JSON object with the action, even a broken one"),
    Rule("full width", "full-width letters and punctuation"),
    Rule("several actions", "the first of several actions or lines counts"),
    Rule("label", "'Action:' before an action", _off_the_front(_LABEL)),
    Rule("marks", "quotes, brackets, asterisks and punctuation", _without_marks),
    Rule("list", "a bullet, or a number", _off_the_front(_LIST_MARK)),
    Rule("lead-in", "'I will', 'let me' … before an action", _off_the_front(_LEAD_IN)),
    Rule("call form", "navigate_to(Fridge)"),
    Rule("verb spelling", "navigate_to, NavigateTo, pick up, put"),
    Rule("verb synonym", "go to, grab, turn on …"),
    Rule("verb parted", "pick the Mug up, turn the DeskLamp on"),
    Rule(
        "put form",
        "put Apple into Fridge, put the Mug in my hand on/in DiningTable: the receptacle counts; "
        "it stands behind 'into', 'onto' or 'to', else mostly behind the last preposition",
    ),
    Rule("article", "the Fridge"),
    Rule("clause", "more is said behind the name: Egg from Fridge, Fridge (it is closed)"),
    Rule("words after", "words behind a verb that needs none: observe the room"),
)
"""All rules."""
