"""Guesses the next tokens of a reply by what earlier replies said after the same few.

A small model says much in the same words. A step of the model takes hardly longer for a guess of
several tokens than for one token, and its scores say which of them it would have drawn itself
(Leviathan et al., "Fast Inference from Transformers via Speculative Decoding", 2023). Here the
guesses come from a table instead of a smaller model, as in the lookup decoding of llama.cpp.
"""

from __future__ import annotations

from collections.abc import Sequence

_CONTEXT = 4  # tokens by which the next one is guessed
_LONGEST = 8  # tokens of a guess
_SURE, _SUREST = 2, 3  # how often it has been so
_MOST = 100_000  # contexts in the table, about 20 MB
_BEFORE = (-1,) * _CONTEXT  # stands before the first token of a reply


class DraftTokens:
    """What replies have said after the same tokens. Not thread-safe."""

    def __init__(self) -> None:
        self._next: dict[tuple[int, ...], tuple[int, int]] = {}  # the token, and how sure it is

    def learn(self, said: Sequence[int]) -> None:
        """Take in a reply, without the token that ends it: a guess never goes beyond an end."""
        words = [*_BEFORE, *said]
        for place, token in enumerate(said):
            context = tuple(words[place : place + _CONTEXT])
            guess, sure = self._next.get(context, (token, 0))
            if guess == token:
                self._next[context] = (token, min(sure + 1, _SUREST))
            else:
                self._next[context] = (guess, sure - 1) if sure > 1 else (token, 1)
        if len(self._next) > _MOST:
            self._next.clear()

    def after(self, said: Sequence[int], most: int) -> list[int]:
        """The tokens that probably follow in a reply: at most ``most``, none where that is open."""
        words = [*_BEFORE, *said[-_CONTEXT:]]
        guesses: list[int] = []
        while len(guesses) < min(most, _LONGEST):
            token, sure = self._next.get(tuple(words[-_CONTEXT:]), (0, 0))
            if sure < _SURE:
                break
            guesses.append(token)
            words.append(token)
        return guesses
