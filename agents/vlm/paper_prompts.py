"""Prompts from a training file in the paper's format, for models that were trained on it.

The file is a list of conversations, in JSON or JSON Lines: ``messages`` with ``role`` and
``content``, or ``conversations`` with ``from`` and ``value``. The user asks for a task, the
assistant decides between ``<DecisionMaking>`` tags, the user shows the result, and so on. The text
that all conversations share is the prompt. Task, action and feedback are the parts that differ. The
file's texts are not templates: braces in them are plain braces.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from io import TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import TextIO

from agents.vlm.prompt_set import (
    IMAGE,
    IMAGE_MARK,
    Decide,
    LastAction,
    PromptSet,
    Sees,
    TurnContext,
)
from er_gym.envs.actions import parse
from er_gym.tasks import verbs
from er_gym.tasks.reading import open_file

ENOUGH = 500
"""How many conversations are read to find the text that all of them share."""

_TASK, _ACTION, _FEEDBACK = "\ufdd1", "\ufdd2", "\ufdd3"
"""Mark the slots of a text; Unicode noncharacters as :data:`~agents.vlm.prompt_set.IMAGE_MARK`."""
_RESERVED = re.compile(f"[{IMAGE_MARK}{_TASK}{_ACTION}{_FEEDBACK}]")
_STOPS = ".!?。！？"
_SLOT = re.compile(f"([{_TASK}{_ACTION}{_FEEDBACK}])([{_STOPS}]?)")
_ROLES = {
    "system": "system",
    "user": "user",
    "human": "user",
    "assistant": "assistant",
    "gpt": "assistant",
}
_DECISION = re.compile(r"<DecisionMaking>(.*?)</DecisionMaking>", re.DOTALL | re.IGNORECASE)
_TROUBLE = re.compile(
    r"\b(?:fail\w*|unsuccess\w*|cannot|can['’]t|could ?n[o'’]t|unable|impossible|illegal|invalid|"
    r"not (?:able|allowed|possible)|did ?n[o'’]t work)\b|失败|无法|不能|没有成功",
    re.IGNORECASE,
)
"""Words that report a failed action."""
_TOKEN = re.compile(r"[^\W\u2e80-\u9fff]+|\s+|.", re.DOTALL)
"""A word, a run of spaces, or one other character; Chinese text is split into characters."""
_ODD_ONE_IN = 20
"""One text in this many may differ from what the others share."""
_TOO_FEW, _ENDS, _MANY, _COMMON = 3, 12, 12, 0.2
"""If all texts share fewer than 3 words, the file may have several wordings: groups of texts that
begin or end with the same 12 tokens. A wording counts if a fifth of the texts have it and share 12
words; with less, it may be a phrase in the tasks."""
_BEGUN = re.compile(r"[.:!?。：！？\n]\s*([^.:!?。：！？\n]*)$")
_ENDED = re.compile(r"([^.!?。！？\n]*)[.!?。！？\n]")
"""A sentence that starts at the end of a text, or ends at its beginning."""
_BETWEEN = re.compile(r"[\s\[\],]*")
_CHUNK = 1 << 20  # characters
_LARGEST_ITEM = 1 << 24  # characters of a conversation; its pictures are files
_VERBS_LONGEST_FIRST = sorted(
    {*verbs.BARE_VERBS, *verbs.OBJECT_VERBS, *verbs.ALIASES}, key=len, reverse=True
)  # so that "put in" is tried before "put"


@dataclass(frozen=True)
class Words:
    """The user's texts, with slots for task, action and feedback.

    Attributes:
        system, first: the system's message, and the first turn.
        usual: the turn after an action; ``after``: by verb, for verbs with another turn.
        failed: the turn after a failed action; "" if no action fails.
    """

    system: str
    first: str
    usual: str
    after: Mapping[str, str]
    failed: str


@dataclass(frozen=True, kw_only=True)
class DerivedPrompts:
    """A set of prompts derived from a training file; see :class:`PromptSet`.

    Attributes:
        samples: the number of conversations read; ``odd``: the number of other items, which are
            skipped.
    """

    name: str
    digest: str
    about: str
    after_observe: int | None
    samples: int
    odd: int
    as_recorded: bool = field(default=False, init=False)
    words: Words = field(repr=False)
    fallback: PromptSet = field(repr=False)

    def check(self, *, decide: Decide, sees: Sees) -> None:
        """See :class:`PromptSet`."""
        if (decide, sees) != ("tags", "pictures"):
            raise ValueError(
                f"the prompts of {self.name} need decide: tags and sees: pictures, not {decide} "
                f"and {sees}; change these, or leave out prompts.dataset"
            )

    def system(self, *, decide: Decide, sees: Sees, task: str = "") -> str:
        """See :class:`PromptSet`.

        Raises:
            ValueError: ``decide`` is not tags, or ``sees`` is not pictures.
        """
        self.check(decide=decide, sees=sees)
        return self.words.system

    def first(self, turn: TurnContext) -> str:
        """See :class:`PromptSet`."""
        return _with_pictures(_filled(self.words.first, {_TASK: turn.task}), 1)

    def next(self, turn: TurnContext, last_action: LastAction) -> str:
        """See :class:`PromptSet`. If no action of the file fails, the feedback is appended."""
        text = self.words.after.get(_verb(last_action.action), self.words.usual)
        if not last_action.success:
            text = self.words.failed or f"{text}\n{_FEEDBACK}"
        values = {_TASK: turn.task, _ACTION: last_action.action, _FEEDBACK: last_action.feedback}
        return _with_pictures(_filled(text, values), last_action.pictures)

    def feedback(self, *, problem: str, decide: Decide, action: str = "") -> str:
        """See :class:`PromptSet`. The paper's files have no such turn, so er-gym's text is used."""
        return self.fallback.feedback(problem=problem, decide=decide)


def read_prompts(path: Path, fallback: PromptSet) -> DerivedPrompts:
    """Read the prompts from a training file; from a large one, from its first :data:`ENOUGH` items.

    Args:
        path: the file.
        fallback: the prompts for turns that such files lack.

    Raises:
        ValueError: the file cannot be read, or the task cannot be separated from the text around
            it.
    """
    found: list[_Sample | None] = []
    try:
        with open_file(path) as raw, TextIOWrapper(raw, encoding="utf-8-sig") as file:
            for item in islice(_items(file), ENOUGH):
                found.append(_sample(item))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from None
    except RecursionError:
        raise ValueError(f"{path}: nested too deeply after {len(found)} whole items") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not UTF-8 text (byte {error.start})") from None
    except json.JSONDecodeError as error:
        raise ValueError(f"{path}: not JSON after {len(found)} whole items: {error.msg}") from None
    samples = [sample for sample in found if sample is not None]
    if not samples:
        raise ValueError(
            f"{path}: none of {len(found)} items is a conversation in which an assistant decides "
            "between <DecisionMaking> tags; give a training file in the paper's format"
        )
    words = _words(samples, path)
    odd = len(found) - len(samples)
    digest = hashlib.sha256(f"{words}{fallback.digest}".encode())
    shown = words.after.get(verbs.OBSERVE, "").count(IMAGE_MARK)
    return DerivedPrompts(
        name=path.name,
        digest=digest.hexdigest(),
        about=f"the texts of {len(samples)} conversations of {path}; {odd} items skipped",
        after_observe=shown if shown in (1, 3, 4) else None,
        samples=len(samples),
        odd=odd,
        words=words,
        fallback=fallback,
    )


# -- the file ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Sample:
    """A conversation.

    Attributes:
        system: "" without a system's message.
        asked: the user's turns; ``decided``: the assistant's decision after each, "" for none.
    """

    system: str
    asked: tuple[str, ...]
    decided: tuple[str, ...]


def _items(file: TextIO) -> Iterator[object]:
    """The values of a JSON list, or of JSON Lines; the file is read as far as they are taken."""
    decoder = json.JSONDecoder()
    text, place, size = "", 0, _CHUNK
    while True:
        between = _BETWEEN.match(text, place)
        place = between.end() if between else place
        try:
            value, place = decoder.raw_decode(text, place)
        except json.JSONDecodeError:
            if len(text) - place > _LARGEST_ITEM:
                raise
            more = file.read(size)
            if more:
                text, place, size = text[place:] + more, 0, 2 * size
                continue
            if place < len(text):
                raise
            return
        yield value


def _sample(item: object) -> _Sample | None:
    """A conversation as it is in the file; None if it is odd."""
    if not isinstance(item, dict):
        return None
    turns = item.get("messages") or item.get("conversations")
    if not isinstance(turns, list) or not all(isinstance(turn, dict) for turn in turns):
        return None
    said = [
        (
            _ROLES.get(str(turn.get("role", turn.get("from")))),
            turn.get("content", turn.get("value")),
        )
        for turn in turns
    ]
    system = item.get("system", "")
    if said and said[0][0] == "system":
        system = said.pop(0)[1]
    if not all(isinstance(text, str) for text in (system, *(text for _, text in said))):
        return None
    alternating = ("user", "assistant") * len(said)
    if any(role != expected for (role, _), expected in zip(said, alternating, strict=False)):
        return None
    asked = tuple(_RESERVED.sub("", text).replace(IMAGE, IMAGE_MARK) for _, text in said[::2])
    decided = tuple(_decision(text) for _, text in said[1::2])
    return _Sample(system, asked, decided) if any(decided) else None


def _decision(text: str) -> str:
    decisions = _DECISION.findall(_RESERVED.sub("", text))
    return " ".join(decisions[-1].split()).strip(" .") if decisions else ""


# -- the text that conversations share -----------------------------------------------------------


def _words(samples: Sequence[_Sample], path: Path) -> Words:
    first_turns = list(dict.fromkeys(sample.asked[0] for sample in samples))
    if len(first_turns) < 2:
        raise ValueError(
            f"{path}: all {len(samples)} conversations begin alike, so the task cannot be told "
            "from the text around it; give a file with several tasks"
        )
    before, after = _frame(first_turns)
    turns = [turn for sample in samples for turn in _turns(sample, before, after)]
    if not turns:
        raise ValueError(
            f"{path}: no conversation goes on after a decision that is an action; "
            "give a training file in the paper's format"
        )
    of_objects = [text for verb, text in turns if verb in verbs.OBJECT_VERBS]
    usual = _usual(of_objects or [text for _, text in turns])
    well = [turn for turn in turns if _trouble(turn[1]) <= _trouble(usual)]
    failures = [text for text in of_objects if _trouble(text) > _trouble(usual)]
    return Words(
        system=Counter(sample.system for sample in samples).most_common(1)[0][0],
        first=f"{before}{_TASK}{after}",
        usual=usual,
        after={verb: text for verb, text in _by_verb(well).items() if text != usual},
        failed=_around_feedback(failures) if failures else "",
    )


def _turns(sample: _Sample, before: str, after: str) -> Iterator[tuple[str, str]]:
    """The user's later turns with slots, each with the verb of the action before it.

    A turn after a verb without an object needs no action slot: its text is kept for that verb
        alone. The verb may also occur in the text for another reason ("you can also observe").
    """
    first = sample.asked[0]
    fits = first.startswith(before) and first.endswith(after)
    task = first[len(before) : len(first) - len(after)].strip().rstrip(_STOPS) if fits else ""
    for decision, text in zip(sample.decided, sample.asked[1:], strict=False):
        verb = _verb(decision)
        if " " in task:  # a single word may stand anywhere
            text = text.replace(task, _TASK)
        if verb in verbs.OBJECT_VERBS:
            text = _mention(decision).sub(_ACTION, text)
        if verb:
            yield verb, text


def _verb(text: str) -> str:
    """The verb at the beginning of an action, "" if there is none."""
    words = f"{' '.join(text.lower().split())} "
    for verb in _VERBS_LONGEST_FIRST:
        if words.startswith(f"{verb} "):
            return verbs.canonical_verb(verb)
    return ""


def _mention(decision: str) -> re.Pattern[str]:
    """A pattern for an action in a text, in the model's spelling or in er-gym's."""
    spellings = sorted({decision, str(parse(decision) or decision)}, key=len, reverse=True)
    forms = (r"\s+".join(map(re.escape, spelling.split())) for spelling in spellings)
    return re.compile(rf"(?<!\w)(?:{'|'.join(forms)})(?!\w)", re.IGNORECASE)


def _usual(texts: Sequence[str]) -> str:
    """The most common text; among several common ones, the one that reports no failure."""
    counts = Counter(texts)
    most = max(counts.values())
    if 10 * most < len(texts):
        return _around_feedback(texts)
    common = [text for text, count in counts.items() if 10 * count >= most]
    return min(common, key=lambda text: (_trouble(text), -counts[text]))


def _by_verb(turns: Sequence[tuple[str, str]]) -> dict[str, str]:
    """By verb, the text of more than half of the turns after it; verbs without such a text are left
    out."""
    texts = defaultdict(list)
    for verb, text in turns:
        texts[verb].append(text)
    most = {verb: Counter(each).most_common(1)[0] for verb, each in texts.items()}
    return {
        verb: text for verb, (text, count) in sorted(most.items()) if 2 * count > len(texts[verb])
    }


def _trouble(text: str) -> int:
    return len(_TROUBLE.findall(text))


def _around_feedback(texts: Sequence[str]) -> str:
    """The text that all share, with a slot for the sentence in which they differ."""
    different = list(dict.fromkeys(texts))
    if len(different) == 1:
        return different[0]
    before, after = _frame(different)
    begun, ended = _BEGUN.search(before), _ENDED.match(after)
    if begun and _count(begun.groups()) < _TOO_FEW:
        before = before[: begun.start(1)]
    if ended and _count(ended.groups()) < _TOO_FEW:
        after = after[ended.end(1) :]
    return f"{before}{_FEEDBACK}{after}"


def _frame(texts: Sequence[str]) -> tuple[str, str]:
    """The shared beginning and end of different texts, in whole words.

    With several wordings, those of the most common one.
    """
    rows = [_TOKEN.findall(text) for text in texts]
    frame = _shared(rows)
    if _count(frame) >= _TOO_FEW:
        return frame
    wordings = defaultdict(list)
    for row in rows:
        wordings[("begins", *row[:_ENDS])].append(row)
        wordings[("ends", *row[-_ENDS:])].append(row)
    for wording in sorted(wordings.values(), key=len, reverse=True):
        if len(wording) < max(2, _COMMON * len(rows)):
            break
        if _count(_shared(wording)) >= _MANY:
            return _shared(wording)
    return frame


def _shared(rows: Sequence[Sequence[str]]) -> tuple[str, str]:
    """The common beginning and end of the token rows, odd rows aside; at least one token stays
    between."""
    needed = len(rows) - len(rows) // _ODD_ONE_IN
    before, rows = _beginning(rows, needed)
    after, _ = _beginning([row[len(before) :][::-1] for row in rows], needed)
    return "".join(before), "".join(reversed(after))


def _beginning(
    rows: Sequence[Sequence[str]], needed: int
) -> tuple[list[str], Sequence[Sequence[str]]]:
    """The tokens that at least ``needed`` rows begin with, and these rows; no row is used up."""
    common: list[str] = []
    while True:
        place = len(common)
        following = Counter(row[place] for row in rows if len(row) > place + 1)
        token, count = following.most_common(1)[0] if following else ("", 0)
        if count < needed:
            return common, rows
        common.append(token)
        rows = [row for row in rows if len(row) > place + 1 and row[place] == token]


def _count(texts: Sequence[str]) -> int:
    """The number of words."""
    return sum(token[0].isalnum() for text in texts for token in _TOKEN.findall(text))


# -- slots ---------------------------------------------------------------------------------------


def _filled(text: str, values: Mapping[str, str]) -> str:
    """Fill the slots; a value that ends with its own full stop replaces the slot's."""

    def value(found: re.Match[str]) -> str:
        slot, stop = found.groups()
        words = _RESERVED.sub("", values[slot]).strip()
        return words if words.endswith(tuple(_STOPS)) else words + stop

    return _SLOT.sub(value, text)


def _with_pictures(text: str, pictures: int) -> str:
    """The text with exactly ``pictures`` marks: marks are added after the last one, or removed from
    the end."""
    few = pictures - text.count(IMAGE_MARK)
    if few > 0:
        head, mark, tail = text.rpartition(IMAGE_MARK)
        return f"{head}{mark}{IMAGE_MARK * few}{tail}"
    for _ in range(-few):
        head, _, tail = text.rpartition(IMAGE_MARK)
        text = head + tail
    return text
