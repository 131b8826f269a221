"""Made-up words in training data, so that a model learns to read around words it does not know."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from functools import cache

from agents.finetune.settings import DataSettings
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.dialects import Dialect
from er_gym.data.trajectory import Trajectory
from er_gym.tasks.wordings.names import types_by_name

_WORD = re.compile(r"[A-Za-z]{2,}")
_SYLLABLE = ("bcdfghjklmnprstvwyz", "aeiou", "bdfgklmnprstx")


def noisy_chat(dialect: Dialect, trajectory: Trajectory, settings: DataSettings) -> Chat:
    """The conversation of a trajectory, with the made-up words that the settings ask for.

    Raises:
        ValueError: the dialect cannot put the trajectory into words, or names are to be made up
            beside pictures.
    """
    noisy = with_word_noise(trajectory, settings.word_noise)
    try:
        chat = dialect.chat(noisy, settings.language)
    except ValueError as error:
        raise ValueError(f"{error}; set data.dialect or data.language") from None
    return with_name_noise(chat, noisy.instruction, settings.name_noise)


def with_word_noise(trajectory: Trajectory, share: float) -> Trajectory:
    """A trajectory in whose English instruction some words are replaced by made-up ones.

    A tiny model knows only the words of its training tasks: where a task says "store the Mug in the
    Fridge", it searches for the Mug and ends. If some words are unknown to it in training, too, it
    learns to make do with the rest: two things, and what stands between them.

    Args:
        trajectory: what was recorded. In its instruction, each word that occurs in the name of an
            object type stays ("can", "light"), and so do words of one letter and Chinese.
        share: the probability, from 0 to 1, with which each other word is replaced by one or two
            random syllables. The same trajectory and share always give the same words, in each
            epoch and run.
    """
    if not share:
        return trajectory
    rng = random.Random(trajectory.id)

    def replaced(match: re.Match[str]) -> str:
        word = match.group()
        if word.lower() in _words_of_names() or rng.random() >= share:
            return word
        made_up = word.lower()
        while made_up == word.lower():
            made_up = _made_up(rng, rng.randint(1, 2))
        return made_up.capitalize() if word[0].isupper() else made_up

    return trajectory.model_copy(
        update={"instruction": _WORD.sub(replaced, trajectory.instruction)}
    )


def with_name_noise(chat: Chat, instruction: str, share: float) -> Chat:
    """A conversation in which some of the types that its instruction names have made-up names.

    A tiny model knows the tasks of its training too well: asked for a rare thing, it thinks of a
    frequent one. A made-up name it cannot know, so it learns to take names from what it is told.

    Args:
        chat: of a trajectory, without pictures; what the system says stays as it is.
        instruction: the trajectory's, in English or Chinese; names in Chinese stay.
        share: the probability, from 0 to 1, with which each type that the instruction names is
            called otherwise, wherever user or assistant mention it: "the tissue box" and
            "TissueBox" become "the bokaru" and "Bokaru". The same conversation and share always
            give the same names.

    Raises:
        ValueError: the conversation has pictures, which cannot show what a made-up name means.
    """
    if not share:
        return chat
    if chat.pictures:
        raise ValueError(
            f"data.name_noise={share} makes up names of things, and pictures show what things are; "
            "set data.name_noise=0, or choose a data.dialect without pictures"
        )
    rng, kinds = random.Random(f"{chat.id} names"), types_by_name()
    named = {kinds[found.lower()]: None for found in _names().findall(instruction)}
    made_up = {kind: _made_up(rng, 3) for kind in named if rng.random() < share}

    def renamed(match: re.Match[str]) -> str:
        name = match.group()
        new = made_up.get(kinds[name.lower()])
        if new is None:
            return name
        return new.capitalize() if name[0].isupper() else new

    def told(turn: ChatTurn) -> ChatTurn:
        if turn.role == "system":
            return turn
        return replace(turn, parts=tuple(_names().sub(renamed, str(p)) for p in turn.parts))

    return replace(chat, turns=tuple(map(told, chat.turns))) if made_up else chat


def _made_up(rng: random.Random, syllables: int) -> str:
    """A word that is in no name of a type."""
    while True:
        word = "".join(rng.choice(letters) for letters in _SYLLABLE * syllables)
        if word not in _words_of_names():
            return word


@cache
def _words_of_names() -> frozenset[str]:
    return frozenset(word for name in types_by_name() for word in _WORD.findall(name))


@cache
def _names() -> re.Pattern[str]:
    """Finds the English names of types, the longest first: a tissue box is no box."""
    names = sorted((name for name in types_by_name() if name.isascii()), key=len, reverse=True)
    return re.compile(rf"\b(?:{'|'.join(map(re.escape, names))})\b", re.IGNORECASE)
