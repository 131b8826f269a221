"""Episodes as rows of tokens, of which some are learnt; and rows as batches of a model."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from agents.finetune.batches import Collator
from agents.reinforce.episodes import Turn
from agents.vlm.chat import Picture
from er_gym.data.pictures import open_picture


@dataclass(frozen=True)
class Row:
    """A conversation, or a part of one, in tokens. Arrays have an entry for each token.

    Attributes:
        ids: (tokens,) int64.
        learnt: (tokens,) bool, those that the model said and that are learnt.
        advantage: (tokens,) float32.
        weight: (tokens,) float32, how much a token counts among those of an update.
        scores: (tokens,) float32, the logarithm of the probability at play; NaN if unknown.
        pictures: in order, as files in memory: their patches would take many times as much.
    """

    ids: NDArray[np.int64]
    learnt: NDArray[np.bool_]
    advantage: NDArray[np.float32]
    weight: NDArray[np.float32]
    scores: NDArray[np.float32]
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True)
class _Piece:
    """A part of a row whose tokens are alike: what is new of a prompt, or a reply."""

    ids: Sequence[int]
    learnt: bool
    advantage: float
    weight: float
    scores: Sequence[float]
    pictures: Sequence[Picture] = ()


def rows_of(
    turns: Sequence[Turn],
    advantages: Sequence[float],
    mean: Literal["token", "turn", "episode"],
    *,
    keep_all: bool = False,
) -> list[Row]:
    """An episode as rows.

    A turn whose prompt begins with all tokens and pictures of the turn before goes on in its row,
    so that what came before is computed once. Where it does not, as when a client left out earlier
    pictures or the words that were drawn are usually written in other tokens, a row begins.

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
    every: list[list[_Piece]] = []
    ids: list[int] = []
    seen: list[Picture] = []
    for turn, advantage, wanted in zip(turns, advantages, learns, strict=True):
        prompt, said, pictures = list(turn.prompt), list(turn.said), list(turn.pictures)
        if not every or prompt[: len(ids)] != ids or pictures[: len(seen)] != seen:
            every.append([])
            ids, seen = [], []
        weight = {"token": 1.0, "turn": 1 / len(said), "episode": 1 / max(tokens, 1)}[mean]
        new = prompt[len(ids) :]
        scores = turn.scores or [np.nan] * len(said)
        every[-1].append(_Piece(new, False, 0.0, 0.0, [0.0] * len(new), pictures[len(seen) :]))
        every[-1].append(_Piece(said, wanted, advantage, weight, scores))
        ids, seen = prompt + said, pictures
    return [row for pieces in every if (row := _row(pieces)) is not None]


def _row(pieces: Sequence[_Piece]) -> Row | None:
    last = max((place for place, piece in enumerate(pieces) if piece.learnt), default=None)
    if last is None:
        return None
    kept = pieces[: last + 1]
    sizes = [len(piece.ids) for piece in kept]
    return Row(
        ids=np.concatenate([np.array(piece.ids, np.int64) for piece in kept]),
        learnt=np.repeat([piece.learnt for piece in kept], sizes),
        advantage=np.repeat([piece.advantage for piece in kept], sizes).astype(np.float32),
        weight=np.repeat([piece.weight for piece in kept], sizes).astype(np.float32),
        scores=np.concatenate([np.array(piece.scores, np.float32) for piece in kept]),
        pictures=tuple(picture for piece in kept for picture in piece.pictures),
    )


@dataclass(frozen=True)
class Batch:
    """Rows as tensors. Those of tokens have an entry for each token that is learnt, row by row.

    Attributes:
        inputs: what the model is given: ``input_ids`` (rows, longest), padded on the right, and
            the pictures (:meth:`agents.finetune.batches.Collator.of_rows`).
        labels: (rows, longest) the token itself, -100 where nothing is learnt.
        advantage, weight, scores: (learnt tokens,).
    """

    inputs: Mapping[str, torch.Tensor]
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
        return Batch(
            {name: each.to(device) for name, each in self.inputs.items()},
            *(each.to(device) for each in (self.labels, self.advantage, self.weight, self.scores)),
        )


def batch_of(rows: Sequence[Row], collator: Collator) -> Batch:
    """Rows as tensors; without rows, one of padding.

    Args:
        rows: at least the first token of each is not learnt.
        collator: pads them and opens their pictures, as in fine-tuning.
    """
    inputs = collator.of_rows(
        [(row.ids, np.where(row.learnt, row.ids, -100)) for row in rows],
        [open_picture(picture.data) for row in rows for picture in row.pictures],
    )
    labels = inputs.pop("labels")

    def of_tokens(name: str) -> torch.Tensor:
        parts = [np.zeros(0, np.float32), *(getattr(row, name)[row.learnt] for row in rows)]
        return torch.from_numpy(np.concatenate(parts))

    return Batch(inputs, labels, of_tokens("advantage"), of_tokens("weight"), of_tokens("scores"))


def batches(lengths: Sequence[int], size: int) -> Iterator[list[int]]:
    """The places of rows in batches of similar length."""
    order = np.argsort(lengths, kind="stable").tolist()
    for start in range(0, len(order), size):
        yield order[start : start + size]


def in_steps(count: int, steps: int, seed: Sequence[int]) -> list[list[int]]:
    """The places of rows for each step of the optimizer in a pass, in random order."""
    order = np.random.default_rng(list(seed)).permutation(count)
    return [each.tolist() for each in np.array_split(order, steps)]
