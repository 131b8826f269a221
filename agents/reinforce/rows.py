"""Episodes as rows of tokens, of which some are learnt; and rows as batches of a model."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from agents.reinforce.episodes import Turn


@dataclass(frozen=True)
class Row:
    """A conversation, or a part of one, in tokens. Arrays have an entry for each token.

    Attributes:
        ids: (tokens,) int64.
        learnt: (tokens,) bool, those that the model said and that are learnt.
        advantage: (tokens,) float32.
        weight: (tokens,) float32, how much a token counts among those of an update.
        scores: (tokens,) float32, the logarithm of the probability at play; NaN if unknown.
    """

    ids: NDArray[np.int64]
    learnt: NDArray[np.bool_]
    advantage: NDArray[np.float32]
    weight: NDArray[np.float32]
    scores: NDArray[np.float32]


def rows_of(
    turns: Sequence[Turn],
    advantages: Sequence[float],
    mean: Literal["token", "turn", "episode"],
    *,
    keep_all: bool = False,
) -> list[Row]:
    """An episode as rows.

    A turn whose prompt begins with all tokens of the turn before goes on in its row, so that what
    came before is computed once. Where it does not, as when a client left out earlier pictures or
    the words that were drawn are usually written in other tokens, a row begins.

    Args:
        turns: of the episode.
        advantages: (turns,).
        mean: what counts alike (:class:`agents.reinforce.settings.ObjectiveSettings`).
        keep_all: whether turns without an advantage are learnt, too, as for the entropy.

    Returns:
        the rows, each up to its last token that is learnt; none if nothing is.
    """
    learns = [bool(advantage) or keep_all for advantage in advantages]
    tokens = sum(len(turn.said) for turn, wanted in zip(turns, learns, strict=True) if wanted)
    every: list[list[tuple[list[int], bool, float, float, Sequence[float]]]] = []
    ids: list[int] = []
    for turn, advantage, wanted in zip(turns, advantages, learns, strict=True):
        prompt, said = list(turn.prompt), list(turn.said)
        if not every or prompt[: len(ids)] != ids:
            every.append([])
            ids = []
        weight = {"token": 1.0, "turn": 1 / len(said), "episode": 1 / max(tokens, 1)}[mean]
        new = prompt[len(ids) :]
        every[-1].append((new, False, 0.0, 0.0, [0.0] * len(new)))
        every[-1].append((said, wanted, advantage, weight, turn.scores or [np.nan] * len(said)))
        ids = prompt + said
    return [row for pieces in every if (row := _row(pieces)) is not None]


def _row(pieces: Sequence[tuple[list[int], bool, float, float, Sequence[float]]]) -> Row | None:
    last = max((place for place, piece in enumerate(pieces) if piece[1]), default=None)
    if last is None:
        return None
    kept = pieces[: last + 1]
    sizes = [len(ids) for ids, *_ in kept]
    return Row(
        ids=np.concatenate([np.array(ids, np.int64) for ids, *_ in kept]),
        learnt=np.repeat([learnt for _, learnt, *_ in kept], sizes),
        advantage=np.repeat([advantage for _, _, advantage, *_ in kept], sizes).astype(np.float32),
        weight=np.repeat([weight for _, _, _, weight, _ in kept], sizes).astype(np.float32),
        scores=np.concatenate([np.array(scores, np.float32) for *_, scores in kept]),
    )


@dataclass(frozen=True)
class Batch:
    """Rows as tensors. Those of tokens have an entry for each token that is learnt, row by row.

    Attributes:
        ids: (rows, longest) padded on the right.
        labels: (rows, longest) the token itself, -100 where nothing is learnt.
        advantage, weight, scores: (learnt tokens,).
    """

    ids: torch.Tensor
    labels: torch.Tensor
    advantage: torch.Tensor
    weight: torch.Tensor
    scores: torch.Tensor

    @property
    def wanted(self) -> torch.Tensor:
        """(learnt tokens,) the tokens that are learnt."""
        return self.labels[self.labels.ne(-100)]

    def on(self, device: Any) -> Batch:
        """The same on a device."""
        return Batch(**{each.name: getattr(self, each.name).to(device) for each in fields(self)})


def batch_of(rows: Sequence[Row], padding: int, multiple: int = 1) -> Batch:
    """Rows as tensors; without rows, one of padding.

    Args:
        rows: at least the first token of each is not learnt.
        padding: the token that fills rows up.
        multiple: the length is one of its multiples
            (:class:`agents.finetune.batches.Collator`).
    """
    longest = max((len(row.ids) for row in rows), default=1)
    longest += -longest % multiple
    ids = torch.full((max(len(rows), 1), longest), padding)
    labels = torch.full_like(ids, -100)
    for place, row in enumerate(rows):
        tokens = torch.from_numpy(row.ids)
        ids[place, : len(tokens)] = tokens
        labels[place, : len(tokens)] = tokens.masked_fill(~torch.from_numpy(row.learnt), -100)

    def of_tokens(name: str) -> torch.Tensor:
        parts = [np.zeros(0, np.float32), *(getattr(row, name)[row.learnt] for row in rows)]
        return torch.from_numpy(np.concatenate(parts))

    return Batch(ids, labels, of_tokens("advantage"), of_tokens("weight"), of_tokens("scores"))


def batches(lengths: Sequence[int], size: int) -> Iterator[list[int]]:
    """The places of rows in batches of similar length."""
    order = np.argsort(lengths, kind="stable").tolist()
    for start in range(0, len(order), size):
        yield order[start : start + size]


def in_steps(count: int, steps: int, seed: Sequence[int]) -> list[list[int]]:
    """The places of rows for each step of the optimizer in a pass, in random order."""
    order = np.random.default_rng(list(seed)).permutation(count)
    return [each.tolist() for each in np.array_split(order, steps)]
