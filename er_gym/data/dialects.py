"""Dialects: how a trajectory is put into words as a conversation.

A dialect is a folder with a file for each language, ``configs/dialects/NAME/LANGUAGE.yaml``, or one
like it of the user's. :class:`DialectTexts` says what a file holds.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, model_validator

from er_gym.data.chat import Chat, ChatTurn, Part, joined
from er_gym.data.knowledge import AROUND
from er_gym.data.trajectory import (
    TAG_OF_KIND,
    THOUGHT_KINDS,
    Language,
    PictureRecord,
    ThoughtKind,
    Trajectory,
    Turn,
)
from er_gym.tasks import verbs
from er_gym.tasks.files import validated
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.suites import config_directory

_AROUND_IN_ORDER = ("right", "behind", "left")
_SLOT = re.compile(r"\{(picture|task|actions|action|feedback)\}")
_FORBIDDEN = re.compile(
    r"</?\s*(?:image|video|audio|DecisionMaking|" + "|".join(TAG_OF_KIND.values()) + r")\s*>"
    r"|<\|[^|<>]*\|>",
    re.IGNORECASE,
)
"""What a text from outside may not contain: places of pictures, tags and special tokens."""


class DialectTexts(BaseModel):
    """The texts of a dialect in one language.

    ``{picture}`` is the place of a picture, ``{task}`` the instruction, ``{actions}`` the actions,
    ``{action}`` the last action and ``{feedback}`` the environment's answer to it.

    Attributes:
        thoughts: ``tags``: each thought in its tag; ``speech``: one running text, each thought
            after one of the ``openers`` of its kind, and one of the ``closers`` at the end.
        system: the system message, with the actions explained; ``""`` for none.
        first: the first user turn, with the task and a picture.
        after: the user turn after an action, with a picture; ``forward``: the same after a step
            forward; ``observed``: after looking around, with three: right, behind, left.
        failed: the user turn after an action that was not done, without a picture.
        astray: the same where a picture is shown: something else was done.
        actions: what each verb means. ``more``: the same for verbs that are listed only in
            conversations in which they occur.
        item: how the system message explains an action; ``{form}`` is such as ``open <object>``.
        list_separator, sentence_separator: stand between actions in a list, and between sentences
            of running text.
        reply_told: how the user tells a reply of the assistant, ``{reply}``
            (:func:`er_gym.data.chat.told_by_user`).
        openers, closers: sentences, for ``speech``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    thoughts: Literal["tags", "speech"]
    system: str
    first: str
    after: str
    forward: str
    observed: str
    failed: str
    astray: str
    actions: dict[str, str]
    more: dict[str, str] = {}
    item: str = "- {form}: {meaning}"
    list_separator: str = ", "
    sentence_separator: str = " "
    reply_told: str
    openers: dict[ThoughtKind, list[str]] = {}
    closers: list[str] = []

    @model_validator(mode="after")
    def _fits(self) -> DialectTexts:
        for name, count in _PICTURES.items():
            found = getattr(self, name).count("{picture}")
            if found != count:
                raise ValueError(f"{name} has {{picture}} {found} times; write it {count} times")
        for name, slot in (("first", "{task}"), ("reply_told", "{reply}")):
            if slot not in getattr(self, name):
                raise ValueError(f"{name} lacks {slot}")
        known = [verb.name for verb in verbs.table()]
        for verb in (*self.actions, *self.more):
            if verb not in known:
                raise ValueError(f"{verb!r} is no verb; choose among {', '.join(known)}")
        if self.thoughts == "speech":
            without = [kind for kind in THOUGHT_KINDS if not self.openers.get(kind)]
            if without or not self.closers:
                raise ValueError(f"give openers of {without}" if without else "give closers")
        return self


_PICTURES = {"first": 1, "after": 1, "forward": 1, "astray": 1, "observed": 3, "failed": 0}
"""How many pictures each text shows."""


def dialect_names() -> tuple[str, ...]:
    """er-gym's own dialects."""
    return tuple(
        sorted({file.parent.name for file in config_directory("dialects").glob("*/*.yaml")})
    )


@dataclass(frozen=True)
class Dialect:
    """A dialect in all its languages.

    Attributes:
        name: as it was given.
        texts: by language.
    """

    name: str
    texts: Mapping[Language, DialectTexts]

    def chat(self, trajectory: Trajectory, language: Language | None = None) -> Chat:
        """The conversation of a trajectory.

        Args:
            trajectory: what was seen, thought and done.
            language: of the dialect's texts; by default the language of the thoughts.

        Raises:
            ValueError: the dialect lacks the language.
        """
        wanted = language or trajectory.language
        if wanted not in self.texts:
            raise ValueError(
                f"the dialect {self.name!r} lacks the language {wanted!r}; it has: "
                f"{', '.join(self.texts)}"
            )
        texts = self.texts[wanted]
        actions = _actions(texts, trajectory)
        turns: list[ChatTurn] = []
        if texts.system:
            explained = "\n".join(
                texts.item.replace("{form}", form).replace("{meaning}", meaning)
                for form, meaning in actions.items()
            )
            turns.append(
                ChatTurn("system", (_filled(texts.system.strip(), {"actions": explained}),))
            )
        listed = texts.list_separator.join(actions)
        for index, turn in enumerate(trajectory.turns):
            last = trajectory.turns[index - 1] if index else None
            values = {
                "task": plain(trajectory.instruction),
                "actions": listed,
                "action": plain(str(last.action)) if last else "",
                "feedback": plain(last.feedback) if last else "",
            }
            shown = _shown(turn.pictures)
            text = getattr(texts, _text_for(shown, last))
            turns.append(ChatTurn("user", _with_pictures(text, shown, values)))
            said = _reply(texts, turn, f"{trajectory.id}/{index}")
            turns.append(ChatTurn("assistant", (said,), turn.train))
        return Chat(trajectory.id, tuple(turns), texts.reply_told)


def load_dialect(name: str) -> Dialect:
    """A dialect of er-gym's by its name, or the user's by its folder.

    Raises:
        ValueError: there is no such dialect; the message lists the known ones.
        TaskFileError: a file of it is damaged.
    """
    own = dialect_names()
    folder = config_directory("dialects") / name if name in own else Path(name)
    files = [(language, folder / f"{language}.yaml") for language in get_args(Language)]
    texts = {
        language: validated(DialectTexts, read_yaml(file), f"{file}:")
        for language, file in files
        if file.is_file()
    }
    if not texts:
        raise ValueError(
            f"there is no dialect {name!r:.80}; choose one of: {', '.join(own)}; or give a folder "
            "that has en.yaml or zh.yaml"
        )
    return Dialect(name, texts)


# -- the user's turns ------------------------------------------------------------------------------


def _shown(pictures: Sequence[PictureRecord]) -> tuple[PictureRecord, ...]:
    """The pictures of a turn that are shown: after ``observe``, what is right, behind and left."""
    around = [each for each in pictures if each.direction in AROUND]
    if not around:
        return tuple(pictures)
    return tuple(sorted(around, key=lambda each: _AROUND_IN_ORDER.index(each.direction)))


def _text_for(shown: Sequence[PictureRecord], last: Turn | None) -> str:
    """The name of the text for a user's turn after the last action."""
    if last is None:
        return "first"
    if not last.success:
        return "astray" if shown else "failed"
    if any(each.direction in AROUND for each in shown):
        return "observed"
    return "forward" if last.verb == verbs.MOVE_FORWARD else "after"


def _with_pictures(
    text: str, shown: Sequence[PictureRecord], values: Mapping[str, str]
) -> tuple[Part, ...]:
    """A text with its slots filled. Where it has too few places for the pictures, the last place
    takes the others; places without a picture are dropped."""
    first, *rest = text.strip().split("{picture}")
    left = list(shown)
    parts: list[Part] = [_filled(first, values)]
    for number, words in enumerate(rest, 1):
        here = left if number == len(rest) else left[:1]
        parts += here
        left = left[len(here) :]
        parts.append(_filled(words, values))
    return joined((*left, *parts))


def _actions(texts: DialectTexts, trajectory: Trajectory) -> dict[str, str]:
    """The actions of a conversation by their form, such as ``open <object>``, and what they mean:
    those of the dialect, and any others that the trajectory has."""
    meanings = dict(texts.actions)
    for turn in trajectory.turns:
        if turn.verb not in meanings and turn.verb in verbs.OBJECT_VERBS:
            meanings[turn.verb] = texts.more.get(turn.verb, turn.verb)
    return {
        f"{verb} <object>" if verb in verbs.OBJECT_VERBS else verb: meaning
        for verb, meaning in meanings.items()
    }


def _filled(text: str, values: Mapping[str, str]) -> str:
    """A text with its slots filled; braces in the values stay."""
    return _SLOT.sub(lambda slot: values.get(slot[1], slot[0]), text)


def plain(text: str) -> str:
    """A text from outside without what would be read as a picture, a tag or a special token: these
    get square brackets."""
    return _FORBIDDEN.sub(lambda found: f"[{found[0].strip('<>').strip('|')}]", text)


# -- the assistant's turns -------------------------------------------------------------------------


def _reply(texts: DialectTexts, turn: Turn, key: str) -> str:
    """What the assistant says at a turn: thoughts and decision."""
    decision = f"<DecisionMaking>{turn.action}</DecisionMaking>"
    thoughts = [(each.kind, plain(each.text).strip()) for each in turn.thoughts]
    if texts.thoughts == "tags":
        tagged = (f"<{TAG_OF_KIND[kind]}>{text}</{TAG_OF_KIND[kind]}>" for kind, text in thoughts)
        return "\n".join((*tagged, decision))
    if not thoughts:
        return decision
    said: list[str] = []
    for number, (kind, text) in enumerate(thoughts):
        said += (_drawn(texts.openers[kind], f"{key}/{number}"), text)
    said.append(_drawn(texts.closers, f"{key}/end"))
    return texts.sentence_separator.join(said) + "\n" + decision


def _drawn(sentences: Sequence[str], key: str) -> str:
    """One of the sentences, always the same for the same key."""
    number = int.from_bytes(hashlib.sha256(key.encode()).digest()[:8], "big")
    return sentences[number % len(sentences)]
