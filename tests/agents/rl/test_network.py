"""The network over types: which inputs change its outputs, and which do not."""

from __future__ import annotations

import numpy as np
import torch
from gymnasium import spaces

from agents.rl.network import TypeNetwork
from agents.rl.subtask_memory import SUBTASK_LAYOUT
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.observations import SCALARS, STATE_LAYOUT

SPACE = spaces.Dict({"state": spaces.Box(-1, 1, (len(STATE_LAYOUT),), np.float32)})


def state(*entries: str) -> torch.Tensor:
    vector = torch.zeros(len(STATE_LAYOUT))
    for entry in entries:
        vector[STATE_LAYOUT.index(entry)] = 1.0
    return vector


def test_only_types_that_can_be_acted_on_get_numbers() -> None:
    network = TypeNetwork(SPACE, width=16, kind=4)
    one = state("navigable:Fridge", "goal:Egg")
    numbers, summary = network({"state": torch.stack([one, state()])})
    assert numbers.shape == (2, len(ACTIONS), 1)
    assert summary.shape == (2, network.summary_width)
    told = {str(ACTIONS[k]) for k in numbers[0].flatten().nonzero().flatten().tolist()}
    assert {"navigate to Fridge", "open Fridge", "pickup Egg", "observe", "end"} <= told
    assert not any("Mug" in each for each in told)
    bare = numbers[1].flatten().nonzero().flatten().tolist()
    assert len(bare) == 3


def test_a_row_does_not_depend_on_the_others_of_the_batch() -> None:
    network = TypeNetwork(SPACE, width=16, kind=4)
    rows = [
        state("navigable:Fridge", "goal:Egg"),
        state("navigable:Mug", "interactable:Mug", "goal:Mug", SCALARS[0]),
        state(),
    ]
    together, _ = network({"state": torch.stack(rows)})
    for row, numbers in zip(rows, together, strict=True):
        alone, _ = network({"state": row[None]})
        assert torch.allclose(alone[0], numbers, atol=1e-6)


def test_the_same_weights_serve_every_type() -> None:
    """Types that are alike in all that is known of them get the same numbers."""
    network = TypeNetwork(SPACE, width=16, kind=4)
    with torch.no_grad():
        network.kinds.zero_()
    numbers, _ = network({"state": torch.stack([state("navigable:Apple", "navigable:Tomato")])})
    apple, tomato = (INDEX[Action("navigate to", name)] for name in ("Apple", "Tomato"))
    assert numbers[0, apple] != 0
    assert torch.allclose(numbers[0, apple], numbers[0, tomato], atol=1e-6)


def test_the_subtask_at_hand_counts() -> None:
    subtask = spaces.Box(0, 1, (len(SUBTASK_LAYOUT),), np.float32)
    network = TypeNetwork(spaces.Dict({**SPACE.spaces, "subtask": subtask}), width=16, kind=4)
    at_hand = torch.zeros(2, len(SUBTASK_LAYOUT))
    at_hand[0, SUBTASK_LAYOUT.index("thing:Egg")] = 1.0
    states = torch.stack([state("navigable:Fridge")] * 2)
    numbers, summary = network({"state": states, "subtask": at_hand})
    assert summary.shape == (2, network.summary_width)
    fridge, egg = INDEX[Action("open", "Fridge")], INDEX[Action("pickup", "Egg")]
    assert numbers[0, fridge] != numbers[1, fridge]
    assert numbers[0, egg] != 0 == numbers[1, egg]


def test_every_weight_learns() -> None:
    network = TypeNetwork(SPACE, width=16, kind=4)
    rows = torch.stack(
        [state("navigable:Fridge", "interactable:Egg", "goal:Egg", *SCALARS), state("goal:Mug")]
    )
    rows[0, STATE_LAYOUT.index("goal:Fridge")] = 0.5
    numbers, summary = network({"state": rows})
    (numbers.square().sum() + summary.sum()).backward()
    idle = [name for name, value in network.named_parameters() if not value.grad.abs().sum()]
    assert idle == []
