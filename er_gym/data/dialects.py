"""Dialects: how a trajectory is put into words as a conversation.

A dialect is a folder with a file for each language, ``configs/dialects/NAME/LANGUAGE.yaml``, or one
like it of the user's. :class:`DialectTexts` says what a file holds.

:func:`system_text` and :func:`user_turn` also make the messages of an agent that plays
(:mod:`agents.vlm.dialect_prompts`), so that a model plays with the texts that it was tuned on.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict, model_validator

from er_gym.data.chat import Chat, ChatTurn, Shown, joined
from er_gym.data.knowledge import AROUND
from er_gym.data.mentions import named_in
from er_gym.data.notes import NoteWords, note
from er_gym.data.recall import PlaceWords, places_text
from er_gym.data.scene_text import (
    FrameWords,
    NamedWords,
    Perceived,
    SceneWords,
    named_text,
    scene_text,
)
from er_gym.data.train_rule import repeats_own_words
from er_gym.data.trajectory import (
    TAG_OF_KIND,
    THOUGHT_KINDS,
    Language,
    ThoughtKind,
    Trajectory,
)
from er_gym.envs.feedback import as_now, told_in
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.files import validated
from er_gym.tasks.reading import read_yaml

SEEN: ThoughtKind = "analysis"
"""The kind of thought by which an assistant tells what it sees."""
_AROUND_IN_ORDER = ("right", "behind", "left")
_SLOT = re.compile(r"\{(picture|task|actions|action|feedback|scene)\}")
_FORBIDDEN = re.compile(
    r"</?\s*(?:image|video|audio|DecisionMaking|" + "|".join(TAG_OF_KIND.values()) + r")\s*>"
    r"|<\|[^|<>]*\|>",
    re.IGNORECASE,
)
"""What a text from outside may not contain: places of pictures, tags and special tokens."""


class DialectTexts(BaseModel):
    """The texts of a dialect in one language.

    ``{picture}`` is the place of a picture, ``{task}`` the instruction, ``{actions}`` the actions,
    ``{action}`` the last action and ``{feedback}`` the environment's answer to it. ``{scene}`` is
    what the agent perceives, in words, in a dialect whose user messages have text in place of
    pictures.

    Attributes:
        thoughts: ``tags``: each thought in its tag; ``speech``: one running text, each thought
            after one of the ``openers`` of its kind, and one of the ``closers`` at the end;
            ``notes``: one short note in a tag, made from what the trajectory records of the turn
            (:mod:`er_gym.data.notes`), except for thoughts of a model that decided itself, which
            stay as they are; ``none``: the decision alone.
        system: the system message, with the actions explained; ``""`` for none.
        first: the first user turn, with the task and a picture.
        after: the user turn after an action, with a picture; ``forward``: the same after a step
            forward; ``observed``: after looking around, with three: right, behind, left.
        failed: the user turn after an action that was not done, without a picture.
        astray: the same where a picture is shown: something else was done.
        actions: what each verb means. ``more``: the same for verbs that are listed only where the
            instruction speaks of them.
        item: how the system message explains an action; ``{form}`` is such as ``open <object>``.
        list_separator, sentence_separator: stand between actions in a list, and between sentences
            of running text.
        reply_told: how the user tells a reply of the assistant, ``{reply}``
            (:func:`er_gym.data.chat.told_by_user`).
        openers, closers: sentences, for ``speech``.
        scene: the words for what the agent perceives; None if nobody tells it.
        named: the words for how far the things are that the instruction names, told after the
            scene by the user; None if nobody tells it.
        places: the words for the places that the agent can go to and has been, told after that by
            the user; None if nobody tells it.
        scene_by: who tells it: ``user``: the user, in place of pictures; ``assistant``: the
            assistant, as its first thought about each new picture, before its note.
        notes: the words of ``notes``.
        frames: the words for questions about single pictures; None for none.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    thoughts: Literal["tags", "speech", "notes", "none"]
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
    scene: SceneWords | None = None
    named: NamedWords | None = None
    places: PlaceWords | None = None
    scene_by: Literal["user", "assistant"] = "user"
    notes: NoteWords | None = None
    frames: FrameWords | None = None

    @property
    def sees(self) -> Literal["pictures", "text"]:
        """What the user's turns show."""
        return "text" if self.scene is not None and self.scene_by == "user" else "pictures"

    @model_validator(mode="after")
    def _fits(self) -> DialectTexts:
        for name, pictures in _PICTURES.items():
            text = getattr(self, name)
            slots = {"picture": pictures, "scene": 0}
            if self.sees == "text":
                slots = {"picture": 0, "scene": 1}
            for slot, count in slots.items():
                found = text.count(f"{{{slot}}}")
                if found != count:
                    raise ValueError(f"{name} has {{{slot}}} {found} times; write it {count} times")
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
        if self.thoughts == "notes" and self.notes is None:
            raise ValueError("thoughts are notes, but there are no words for them; give notes")
        for name in ("named", "places"):
            if getattr(self, name) is not None and self.sees != "text":
                raise ValueError(f"{name} goes with a scene that the user tells; leave it out")
        if self.scene_by == "assistant" and (self.scene is None or self.thoughts != "notes"):
            raise ValueError("scene_by is assistant; give scene, and set thoughts to notes")
        return self


_PICTURES = {"first": 1, "after": 1, "forward": 1, "astray": 1, "observed": 3, "failed": 0}
"""How many pictures each text shows, in a dialect with pictures."""


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

    def texts_in(self, language: Language) -> DialectTexts:
        """The texts in a language.

        Raises:
            ValueError: the dialect lacks it.
        """
        if language not in self.texts:
            raise ValueError(
                f"the dialect {self.name!r} lacks the language {language!r}; it has: "
                f"{', '.join(self.texts)}"
            )
        return self.texts[language]

    def chat(self, trajectory: Trajectory, language: Language | None = None) -> Chat:
        """The conversation of a trajectory.

        Args:
            trajectory: what was seen, thought and done.
            language: of the dialect's texts and of the feedback; by default the language of the
                thoughts.

        Raises:
            ValueError: the dialect lacks the language.
        """
        language = language or trajectory.language
        texts = self.texts_in(language)
        turns: list[ChatTurn] = []
        if system := system_text(texts, trajectory.instruction):
            turns.append(ChatTurn("system", (system,)))
        before: Perceived | None = None
        last: ActionResult | None = None
        for index, turn in enumerate(trajectory.turns):
            now = Perceived.at(turn, trajectory.turns[index - 1] if index else None, before)
            pictures = [(each.direction, each) for each in turn.pictures]
            told = user_turn(texts, trajectory.instruction, last, pictures, now, before)
            turns.append(ChatTurn("user", told))
            seen = _seen(texts, trajectory, index, now, before, last)
            reply = _reply(texts, trajectory, index, seen)
            turns.append(ChatTurn("assistant", (reply,), turn.train))
            answer = told_in(language, as_now(turn.feedback))
            before, last = now, ActionResult(str(turn.action), turn.success, answer)
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
    texts = {language: _read_texts(file) for language, file in files if file.is_file()}
    if not texts:
        raise ValueError(
            f"there is no dialect {name!r:.80}; choose one of: {', '.join(own)}; or give a folder "
            "that has en.yaml or zh.yaml"
        )
    return Dialect(name, texts)


def _read_texts(file: Path) -> DialectTexts:
    """Read a file of a dialect. ``like: NAME`` takes all entries that it lacks from NAME."""
    data = read_yaml(file)
    if isinstance(data, dict) and "like" in data:
        name = data.pop("like")
        other = config_directory("dialects") / str(name) / file.name
        if name not in dialect_names() or not other.is_file():
            raise ValueError(
                f"{file}: there is no {file.stem} dialect {name!r:.80} to be like; choose one of: "
                f"{', '.join(dialect_names())}"
            )
        data = {**_read_texts(other).model_dump(exclude_unset=True), **data}
    return validated(DialectTexts, data, f"{file}:")


# -- the system's and the user's turns -------------------------------------------------------------


@dataclass(frozen=True)
class ActionResult:
    """The last action and its result.

    Attributes:
        action: such as ``navigate to Fridge``; or the text of a reply that names no action.
        success, feedback: the environment's answer.
    """

    action: str
    success: bool
    feedback: str

    @property
    def on_the_spot(self) -> bool:
        """Whether the agent neither moves nor turns when it does this."""
        moves = (verbs.NAVIGATE, verbs.MOVE_FORWARD, verbs.OBSERVE)
        return not self.action.startswith(moves)


def system_text(texts: DialectTexts, instruction: str) -> str:
    """The system message; ``""`` for none.

    Args:
        texts: the dialect's.
        instruction: the task. It decides which of the verbs beyond the usual ones are listed.
    """
    explained = "\n".join(
        texts.item.replace("{form}", form).replace("{meaning}", meaning)
        for form, meaning in _actions(texts, instruction).items()
    )
    return _filled(texts.system.strip(), {"actions": explained})


def user_turn(
    texts: DialectTexts,
    instruction: str,
    last: ActionResult | None,
    pictures: Sequence[tuple[str, Shown]],
    now: Perceived | None = None,
    before: Perceived | None = None,
) -> tuple[str | Shown, ...]:
    """A message of the user: texts and pictures in order.

    Args:
        texts: the dialect's.
        instruction: the task.
        last: the last action; None in the first turn.
        pictures: the pictures of this turn with their directions (:func:`shows_anew`).
        now: what the agent perceives, and ``before``: what it perceived before its last action, for
            dialects in which the user tells it. ``now`` is None if nothing was done.
    """
    values = {
        "task": without_markup(instruction),
        "actions": texts.list_separator.join(_actions(texts, instruction)),
        "action": without_markup(last.action) if last else "",
        "feedback": without_markup(last.feedback) if last else "",
    }
    if texts.sees == "pictures":
        shown = _shown(pictures)
        text = getattr(texts, _text_for(last, [direction for direction, _ in shown]))
        return _with_pictures(text, [picture for _, picture in shown], values)
    lines = [told_scene(texts, now, before, last)]
    if texts.named is not None and now is not None:
        lines.append(named_text(texts.named, named_in(instruction), now))
    if texts.places is not None and now is not None:
        lines.append(places_text(texts.places, now.navigable, now.recalled))
    values["scene"] = "\n".join(filter(None, lines))
    around = [*now.views] if now else []
    told = _filled(getattr(texts, _text_for(last, around)).strip(), values)
    return (told.strip(),)


def told_scene(
    texts: DialectTexts, now: Perceived | None, before: Perceived | None, last: ActionResult | None
) -> str:
    """What the agent perceives, in the dialect's words; ``""`` if there is nothing to tell.

    Args:
        texts: the dialect's, with words for scenes.
        now, before, last: as :func:`user_turn` takes them.
    """
    assert texts.scene is not None
    told = ""
    if now is not None:
        stayed = last is not None and last.on_the_spot
        told = scene_text(texts.scene, now, before, stayed=stayed)
    return told or (texts.scene.same if last is not None and last.success else "")


def shows_anew(last_success: bool, picture: bytes, last_picture: bytes) -> bool:
    """Whether the view ahead is shown at a turn: not after a failure that left it as it was.

    Args:
        last_success: whether the last action succeeded; True at first.
        picture: the file of the view, and ``last_picture`` of the last picture shown.
    """
    return last_success or picture != last_picture


def _shown(pictures: Sequence[tuple[str, Shown]]) -> list[tuple[str, Shown]]:
    """The pictures of a turn that are shown: after ``observe``, what is right, behind and left."""
    around = [each for each in pictures if each[0] in AROUND]
    return sorted(around, key=lambda each: _AROUND_IN_ORDER.index(each[0])) or [*pictures]


def _text_for(last: ActionResult | None, directions: Sequence[str]) -> str:
    """The name of the text for a user's turn after the last action, by what is shown."""
    if last is None:
        return "first"
    if not last.success:
        return "astray" if directions else "failed"
    if any(each in AROUND for each in directions):
        return "observed"
    return "forward" if last.action == verbs.MOVE_FORWARD else "after"


def _with_pictures(
    text: str, shown: Sequence[Shown], values: Mapping[str, str]
) -> tuple[str | Shown, ...]:
    """A text with its slots filled. Where it has too few places for the pictures, the last place
    takes the others; places without a picture are dropped."""
    first, *rest = text.strip().split("{picture}")
    left = list(shown)
    parts: list[str | Shown] = [_filled(first, values)]
    for number, words in enumerate(rest, 1):
        here = left if number == len(rest) else left[:1]
        parts += here
        left = left[len(here) :]
        parts.append(_filled(words, values))
    return joined((*left, *parts))


def _actions(texts: DialectTexts, instruction: str) -> dict[str, str]:
    """The actions of a conversation by their form, such as ``open <object>``, and what they mean:
    those of the dialect, and any others that the instruction speaks of."""
    meanings = dict(texts.actions)
    for verb in verbs.table():
        if verb.name not in meanings and not verb.alone and _speaks_of(instruction, verb.said):
            meanings[verb.name] = texts.more.get(verb.name, verb.name)
    return {
        f"{verb} <object>" if verb in verbs.OBJECT_VERBS else verb: meaning
        for verb, meaning in meanings.items()
    }


def _speaks_of(text: str, phrases: Sequence[str]) -> bool:
    """Whether a text has one of the phrases, at the beginning of a word."""
    starts = (r"(?<![A-Za-z])" + re.escape(each) if each.isascii() else each for each in phrases)
    return re.search("|".join(starts), text, re.IGNORECASE) is not None


def _filled(text: str, values: Mapping[str, str]) -> str:
    """A text with its slots filled; braces in the values stay."""
    return _SLOT.sub(lambda slot: values.get(slot[1], slot[0]), text)


def without_markup(text: str) -> str:
    """A text from outside without what would be read as a picture, a tag or a special token: these
    get square brackets."""
    return _FORBIDDEN.sub(lambda found: f"[{found[0].strip('<>').strip('|')}]", text)


# -- the assistant's turns -------------------------------------------------------------------------


def in_tag(kind: ThoughtKind, text: str) -> str:
    """A thought in its tag."""
    return f"<{TAG_OF_KIND[kind]}>{text}</{TAG_OF_KIND[kind]}>"


def _seen(
    texts: DialectTexts,
    trajectory: Trajectory,
    index: int,
    now: Perceived,
    before: Perceived | None,
    last: ActionResult | None,
) -> str:
    """What the assistant says first of what it is shown, in a dialect in which it tells that."""
    shown = bool(trajectory.turns[index].pictures)
    if texts.scene_by == "user" or not shown or _thinks_itself(trajectory, index):
        return ""
    return told_scene(texts, now, before, last)


def _reply(texts: DialectTexts, trajectory: Trajectory, index: int, seen: str) -> str:
    """What the assistant says at a turn: what it sees, if it tells that, thoughts and decision."""
    turn = trajectory.turns[index]
    decision = f"<DecisionMaking>{turn.action}</DecisionMaking>"
    thoughts = [(each.kind, without_markup(each.text).strip()) for each in turn.thoughts]
    noted = texts.thoughts == "notes" and not _thinks_itself(trajectory, index)
    if noted and texts.notes is not None:
        thoughts = [note(texts.notes, trajectory, index)]
    if seen:
        thoughts.insert(0, (SEEN, seen))
    if texts.thoughts in ("tags", "notes"):
        return "\n".join((*(in_tag(kind, text) for kind, text in thoughts), decision))
    if texts.thoughts == "none" or not thoughts:
        return decision
    key = f"{trajectory.id}/{index}"
    said: list[str] = []
    for number, (kind, text) in enumerate(thoughts):
        said += (_drawn(texts.openers[kind], f"{key}/{number}"), text)
    said.append(_drawn(texts.closers, f"{key}/end"))
    return texts.sentence_separator.join(said) + "\n" + decision


def _thinks_itself(trajectory: Trajectory, index: int) -> bool:
    """Whether the thoughts of a turn are those of the model that decided it, too: of the one that
    decided all, or, where a correction begins, of the one that failed."""
    return repeats_own_words(trajectory, index) or any(
        each.writer == trajectory.actor for one in trajectory.turns for each in one.thoughts
    )


def _drawn(sentences: Sequence[str], key: str) -> str:
    """One of the sentences, always the same for the same key."""
    number = int.from_bytes(hashlib.sha256(key.encode()).digest()[:8], "big")
    return sentences[number % len(sentences)]
