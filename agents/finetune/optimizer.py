"""Muon for the matrices of a model's layers and AdamW for its other weights, as one optimizer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch


class MuonAdamW(torch.optim.Optimizer):
    """Steps :class:`torch.optim.Muon` and :class:`torch.optim.AdamW` together.

    Muon (Jordan et al. 2024) is for matrices inside of a network; embeddings, norms and biases stay
    with AdamW. Muon's steps are scaled to the size of AdamW's (Liu et al., arXiv 2502.16982), so
    one learning rate serves both.

    Args:
        network: its weights that learn are optimised. Layers are what their names call ``layers``
            or ``blocks``.
        learning_rate, weight_decay: of both; norms and biases do not decay.
    """

    def __init__(self, network: torch.nn.Module, learning_rate: float, weight_decay: float) -> None:
        matrices: list[torch.nn.Parameter] = []
        others: list[torch.nn.Parameter] = []
        vectors: list[torch.nn.Parameter] = []
        for name, weight in network.named_parameters():
            if not weight.requires_grad:
                continue
            if weight.ndim < 2:
                kind = vectors
            elif weight.ndim == 2 and ("layers." in name or "blocks." in name):
                kind = matrices
            else:
                kind = others
            kind.append(weight)
        self._both: list[torch.optim.Optimizer] = []
        super().__init__([*matrices, *others, *vectors], {"lr": learning_rate})
        if matrices:
            muon = torch.optim.Muon(
                matrices, learning_rate, weight_decay, adjust_lr_fn="match_rms_adamw"
            )
            self._both.append(muon)
        groups = [
            {"params": weights, "weight_decay": decay}
            for weights, decay in ((others, weight_decay), (vectors, 0.0))
            if weights
        ]
        if groups:
            self._both.append(torch.optim.AdamW(groups, learning_rate))

    @property
    def param_groups(self) -> list[dict[str, Any]]:
        """The groups of both, so that a scheduler sets the learning rate of both."""
        return [group for each in self._both for group in each.param_groups]

    @param_groups.setter
    def param_groups(self, groups: list[dict[str, Any]]) -> None:
        """Torch's constructor sets one group of all weights; the groups are those of both."""

    @torch.no_grad()
    def step(self, closure: Callable[[], float] | None = None) -> float | None:  # type: ignore[override]
        """Step both."""
        if closure is not None:
            raise ValueError("MuonAdamW takes no closure")
        for each in self._both:
            each.step()
        return None

    def state_dict(self) -> dict[str, Any]:
        """The states of both."""
        return {"both": [each.state_dict() for each in self._both]}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Continue from the states of both."""
        for each, state in zip(self._both, state_dict["both"], strict=True):
            each.load_state_dict(state)
