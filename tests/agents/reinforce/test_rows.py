"""Which tokens are learnt, with which weights; and the objective, against hand computation."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from agents.finetune.batches import Collator
from agents.reinforce.episodes import Turn
from agents.reinforce.objective import losses, token_scores
from agents.reinforce.rows import batch_of, batches, in_steps, rows_of
from agents.reinforce.settings import ObjectiveSettings
from agents.vlm.chat import Picture

TURNS = (
    Turn([1, 2, 3], [4, 5], [-0.1, -0.2], "a"),
    Turn([1, 2, 3, 4, 5, 6], [7], [-0.3], "b"),  # goes on
    Turn([1, 2, 9], [8, 8, 8], [-0.4, -0.5, -0.6], "c"),  # written in other tokens: begins anew
    Turn([1, 2, 9, 8, 8, 8, 3], [4], [], "d"),
)
PADS = Collator(None, None, (1, 1), padding=0)


def test_only_what_was_said_is_learnt() -> None:
    first, second = rows_of(TURNS, [1.0, -2.0, 0.5, 3.0], "token")
    assert first.ids.tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert first.learnt.tolist() == [False] * 3 + [True] * 2 + [False, True]
    assert first.advantage[first.learnt].tolist() == [1.0, 1.0, -2.0]
    assert first.scores[first.learnt].tolist() == pytest.approx([-0.1, -0.2, -0.3])
    assert second.ids.tolist() == [1, 2, 9, 8, 8, 8, 3, 4]
    assert np.isnan(second.scores[-1])


def test_what_has_no_advantage_is_left_out() -> None:
    [row] = rows_of(TURNS, [1.0, 0.0, 0.0, 0.0], "token")
    assert row.ids.tolist() == [1, 2, 3, 4, 5]  # up to the last that is learnt
    assert rows_of(TURNS, [0.0] * 4, "token") == []
    assert len(rows_of(TURNS, [0.0] * 4, "token", keep_all=True)) == 2


def test_a_row_has_the_pictures_that_it_shows() -> None:
    """A row goes on only where the pictures before are the same, too; it has none after its end."""
    a, b, c = (Picture(each, "image/png", 1, 1) for each in (b"a", b"b", b"c"))
    turns = (
        Turn([9, 1], [4], [], "", [a]),
        Turn([9, 1, 4, 9, 9], [5], [], "", [a, b, c]),
        Turn([9, 1, 4, 9, 9, 5, 9], [6], [], "", [a, b, b, c]),  # the third is another one
        Turn([9, 1, 4, 9, 9, 5, 9, 6, 9], [7], [], "", [a, b, b, c, c]),
    )
    first, second = rows_of(turns, [1.0, 1.0, 1.0, 0.0], "token")
    assert (first.ids.tolist(), first.pictures) == ([9, 1, 4, 9, 9, 5], (a, b, c))
    assert (second.ids.tolist(), second.pictures) == ([9, 1, 4, 9, 9, 5, 9, 6], (a, b, b, c))
    [row] = rows_of(turns, [1.0, 0.0, 0.0, 0.0], "token")
    assert row.pictures == (a,)


@pytest.mark.parametrize(
    ("mean", "weights"),
    [
        ("token", [1, 1, 1, 1, 1, 1, 1]),
        ("turn", [1 / 2, 1 / 2, 1, 1 / 3, 1 / 3, 1 / 3, 1]),
        ("episode", [1 / 7] * 7),
    ],
)
def test_tokens_weigh_by_what_counts_alike(mean: str, weights: list[float]) -> None:
    rows = rows_of(TURNS, [1.0] * 4, mean)  # type: ignore[arg-type]
    batch = batch_of(rows, PADS)
    assert batch.weight.tolist() == pytest.approx(weights)
    assert batch.wanted.tolist() == [4, 5, 7, 8, 8, 8, 4]
    assert batch.inputs["input_ids"].tolist()[0] == [1, 2, 3, 4, 5, 6, 7, 0]
    assert batch_of(rows, replace(PADS, multiple=32)).inputs["input_ids"].shape == (2, 32)


def test_batches_are_of_similar_length_and_steps_of_all_rows() -> None:
    assert list(batches([5, 1, 4, 2], 2)) == [[1, 3], [2, 0]]
    parts = in_steps(5, 2, (0, 1))
    assert sorted([*parts[0], *parts[1]]) == [0, 1, 2, 3, 4]
    assert parts == in_steps(5, 2, (0, 1)) != in_steps(5, 2, (0, 2))
    assert batch_of([], replace(PADS, padding=7)).inputs["input_ids"].tolist() == [[7]]


def test_the_objective_is_the_clipped_ratio_with_divergence_and_entropy() -> None:
    logits = torch.tensor([[0.0, math.log(3)], [0.0, 0.0]])
    now = token_scores(logits, torch.tensor([1, 0]), temperature=1.0)
    assert now.chance.exp().tolist() == pytest.approx([0.75, 0.5])
    assert now.entropy.tolist() == pytest.approx(
        [-0.75 * math.log(0.75) - 0.25 * math.log(0.25), math.log(2)]
    )
    assert token_scores(2 * logits, torch.tensor([1, 0]), 2.0).chance.exp().tolist() == (
        pytest.approx([0.75, 0.5])
    )
    at_play = torch.tensor([0.5, 0.5]).log()  # the ratios are 1.5 and 1
    settings = ObjectiveSettings(clip=0.2, clip_high=0.3, kl=0.5, entropy=0.1)
    at_start = torch.tensor([0.75, 0.25]).log()
    found, told = losses(now, at_play, at_start, torch.tensor([2.0, -1.0]), settings)
    apart = math.log(0.25 / 0.5)
    divergence = math.exp(apart) - apart - 1
    assert found.tolist() == pytest.approx(
        [
            -2 * 1.3 - 0.1 * now.entropy[0].item(),
            1 + 0.5 * divergence - 0.1 * math.log(2),
        ]
    )
    assert told["clipped"].tolist() == [1.0, 0.0]
    # what is worse than expected is not spared by the clip where it grew
    worse, _ = losses(now, at_play, None, torch.tensor([-2.0, -1.0]), ObjectiveSettings())
    assert worse.tolist() == pytest.approx([3.0, 1.0])


def test_a_token_that_is_never_drawn_is_as_if_it_were_not_there() -> None:
    logits = torch.tensor([[0.0, 5.0, math.log(3)]], requires_grad=True)
    with_it = token_scores(logits, torch.tensor([2]), 2.0, never=1, of_entropy=True)
    without = token_scores(logits[:, [0, 2]], torch.tensor([1]), 2.0, of_entropy=True)
    assert with_it.chance.tolist() == pytest.approx(without.chance.tolist())
    assert with_it.entropy.tolist() == pytest.approx(without.entropy.tolist())
    (with_it.chance + with_it.entropy).sum().backward()
    assert logits.grad is not None
    assert logits.grad[0, 1] == 0
    assert logits.grad.isfinite().all()
