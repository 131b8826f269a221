"""A frame as a training conversation for vision: a picture, and the objects in view.

The answers have the format in which a dialect describes a scene (:mod:`er_gym.data.scene_text`),
and the description of the whole scene is the same as the assistant's at play.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from er_gym.data.cells import CoveredPicture
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.dialects import (
    SEEN,
    ActionResult,
    Dialect,
    in_tag,
    told_scene,
    user_turn,
)
from er_gym.data.frames import Frame
from er_gym.data.scene_text import FrameWords, Perceived, SceneWords, thing_text
from er_gym.data.trajectory import Language, PictureRecord
from er_gym.tasks import verbs

QUESTIONS = 4
"""Questions about single things in a conversation, at most."""
_UNSEEN = 0.3
"""The share of them that are about things that are not in view."""
_CAME = ActionResult(verbs.NAVIGATE, True, "")
"""After it, the user shows the view ahead and no more."""
_LOOKED_AROUND = ActionResult(verbs.OBSERVE, True, "")


@dataclass(frozen=True)
class Question:
    """A question about a type, and the true answer.

    Attributes:
        kind: the type.
        text, answer: in the dialect's words.
    """

    kind: str
    text: str
    answer: str


def frame_chat(dialect: Dialect, frame: Frame, language: Language = "en") -> Chat:
    """The conversation about a frame.

    The user shows the picture, and the assistant lists the objects in view. Questions about single
    types come before or after the list, so that some can be answered only from the picture. The
    pictures of a look around, if the frame has one, come last.

    Raises:
        ValueError: the dialect lacks the language, or words for frames.
    """
    texts = dialect.texts_in(language)
    words, scene = words_for_frames(dialect, language)
    draw = np.random.default_rng(zlib.crc32(frame.id.encode()))
    picture = user_turn(texts, "", _CAME, [("ahead", _covered(frame, scene))])
    before = seen_ahead(frame)
    sees = in_tag(SEEN, told_scene(texts, before, None, None))
    rounds = [(each.text, each.answer) for each in questions(words, scene, frame, draw)]
    if not rounds or draw.random() < 0.5:
        said = [(picture, sees), *(((asked,), answer) for asked, answer in rounds)]
    else:
        (asked, answer), *more = [*rounds, (words.look, sees)]
        said = [((*picture, f"\n{asked}"), answer), *(((a,), b) for a, b in more)]
    if frame.views:
        now = Perceived(frame.view, frame.views, "", frame.navigable, frame.interactable)
        around = [(each.direction, each) for each in frame.pictures]
        shown = user_turn(texts, "", _LOOKED_AROUND, around)
        said.append((shown, in_tag(SEEN, told_scene(texts, now, before, _LOOKED_AROUND))))
    turns: list[ChatTurn] = []
    for user, assistant in said:
        turns += (ChatTurn("user", user), ChatTurn("assistant", (assistant,), train=True))
    return Chat(frame.id, tuple(turns), texts.reply_told)


def _covered(frame: Frame, words: SceneWords) -> PictureRecord:
    """The picture ahead with what covers it, as far as that is known, in the scene's words."""
    ahead = frame.pictures[0]
    if not frame.cells:
        return ahead
    covers = tuple(each or words.nothing for each in frame.covers)
    return CoveredPicture(**ahead.model_dump(), covers=covers, cells=frame.cells)


def seen_ahead(frame: Frame) -> Perceived:
    """What is perceived in the view ahead only; objects out of reach count as far."""
    return Perceived(frame.view, {}, "", frame.interactable, frame.interactable)


def words_for_frames(dialect: Dialect, language: Language) -> tuple[FrameWords, SceneWords]:
    """The words for questions, and those for scenes.

    Raises:
        ValueError: the dialect lacks them, or the language.
    """
    texts = dialect.texts_in(language)
    if texts.frames is None or texts.scene is None or texts.sees != "pictures":
        raise ValueError(
            f"the dialect {dialect.name!r} has no words for frames; choose sight, or give one with "
            "scene, frames, and scene_by: assistant"
        )
    return texts.frames, texts.scene


def questions(
    words: FrameWords, scene: SceneWords, frame: Frame, draw: np.random.Generator
) -> Iterator[Question]:
    """Questions about single types, of which some are not in view: as many as there are, but no
    more than :data:`QUESTIONS`."""
    nearest = {each.type: each for each in reversed(frame.view)}
    there, absent = sorted(nearest), frame.absent
    unseen = int(draw.binomial(QUESTIONS, _UNSEEN)) if there else QUESTIONS
    asked_for = _drawn(draw, absent, unseen) + _drawn(draw, there, QUESTIONS - unseen)
    for kind in _drawn(draw, asked_for, QUESTIONS):  # in an order that gives nothing away
        asked = words.where.replace("{thing}", kind)
        if kind not in nearest:
            yield Question(kind, asked, words.unseen.replace("{thing}", kind))
            continue
        one = nearest[kind]
        said = thing_text(scene, one, seen_ahead(frame))
        side = getattr(words, one.side)
        answer = words.found.replace("{thing}", said).replace("{side}", side)
        yield Question(kind, asked, answer)


def _drawn(draw: np.random.Generator, kinds: list[str], number: int) -> list[str]:
    return [kinds[k] for k in draw.permutation(len(kinds))[:number].tolist()]
