"""Which tokens of a conversation get loss: for collators of trainers without a flag per turn."""

from __future__ import annotations

from collections.abc import Sequence


def train_mask(
    tokens: Sequence[int], train: Sequence[bool], *, begin: Sequence[int], end: Sequence[int]
) -> list[bool]:
    """Mark the tokens that get loss: those of the assistant's turns that are to be learnt.

    With Qwen's chat template, ``begin`` are the tokens of ``<|im_start|>assistant`` and a line's
    end, and ``end`` is ``<|im_end|>``. What a turn says gets loss and so does its ``end``, since
    the model has to learn to stop; ``begin`` gets none, since the template writes it.

    Args:
        tokens: (n,) the tokens of a conversation, pictures expanded or not; padding may follow.
        train: for each turn of the assistant in order, whether it is learnt.
        begin, end: the tokens around a turn of the assistant; they may not occur inside.

    Returns:
        (n,) whether each token gets loss.

    Raises:
        ValueError: there are not as many turns as flags, or a turn has no end: the conversation was
            cut off, or ``begin`` and ``end`` are another template's.
    """
    ids, first, last = list(tokens), list(begin), list(end)
    if not first or not last:
        raise ValueError("begin and end have at least one token each")
    mask = [False] * len(ids)
    place = turn = 0
    while (start := _find(ids, first, place)) >= 0:
        start += len(first)
        stop = _find(ids, last, start)
        if stop < 0:
            raise ValueError(f"turn {turn} of the assistant has no end; was it cut off?")
        place = stop + len(last)
        if turn < len(train) and train[turn]:
            mask[start:place] = [True] * (place - start)
        turn += 1
    if turn != len(train):
        raise ValueError(
            f"the tokens hold {turn} turns of the assistant, but there are {len(train)} flags; "
            "was the conversation cut off, or do begin and end belong to another template?"
        )
    return mask


def _find(tokens: list[int], wanted: list[int], start: int) -> int:
    """The place of a run of tokens from ``start`` on, -1 if there is none."""
    place = start
    while True:
        try:
            place = tokens.index(wanted[0], place)
        except ValueError:
            return -1
        if tokens[place : place + len(wanted)] == wanted:
            return place
        place += 1
