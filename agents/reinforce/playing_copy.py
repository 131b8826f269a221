"""The model that plays while the other one learns: the same weights, seen in another way."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import torch


class PlayingCopy:
    """A copy of a model to play with, which has the same weights in the same memory.

    The sampler puts its own attention and its settings of generation into the model that it is
    given, so it gets a copy of everything else.

    Args:
        network: the model that learns.
        rounded: whether the copy has weights of its own in bfloat16 where those that learn are in
            float32; :meth:`refresh` brings them up to date.

    Attributes:
        network: the copy.
    """

    def __init__(self, network: Any, *, rounded: bool) -> None:
        self._pairs: list[tuple[torch.Tensor, torch.Tensor]] = []
        memo: dict[int, Any] = {}
        for weight in network.parameters():
            own = weight
            if rounded and weight.dtype == torch.float32:
                own = torch.nn.Parameter(weight.detach().bfloat16(), requires_grad=False)
                self._pairs.append((own, weight))
            memo[id(weight)] = own
        self.network = deepcopy(network, memo)

    @torch.no_grad()
    def refresh(self) -> None:
        """Take over what the other model has learnt."""
        for own, weight in self._pairs:
            own.copy_(weight)
