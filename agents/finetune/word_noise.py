"""Instructions with made-up words, so that a model learns to read around words it does not know."""

from __future__ import annotations

import random
import re
from functools import cache

from er_gym.data.trajectory import Trajectory
from er_gym.tasks.wordings.names import types_by_name

_WORD = re.compile(r"[A-Za-z]{2,}")
_SYLLABLE = ("bcdfghjklmnprstvwyz", "aeiou", "bdfgklmnprstx")


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
        while made_up == word.lower() or made_up in _words_of_names():
            syllables = rng.randint(1, 2)
            made_up = "".join(rng.choice(letters) for letters in _SYLLABLE * syllables)
        return made_up.capitalize() if word[0].isupper() else made_up

    return trajectory.model_copy(
        update={"instruction": _WORD.sub(replaced, trajectory.instruction)}
    )


@cache
def _words_of_names() -> frozenset[str]:
    return frozenset(word for name in types_by_name() for word in _WORD.findall(name))
