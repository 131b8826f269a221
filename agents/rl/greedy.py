"""Plays with a trained network: the legal action with the highest number."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from agents.rl.network import TypeNetwork
from agents.rl.policy_file import load_network
from agents.rl.policy_observation import IMAGES, Obs


class GreedyPolicy:
    """Chooses the action that the learner of a model file would choose without exploring.

    That is the most probable one for MaskablePPO and the most valuable one for DQN and QR-DQN. The
    value of the state, which learners add to the value of every action, does not change the choice
    and is left out.

    Args:
        network: trained.
    """

    def __init__(self, network: TypeNetwork) -> None:
        self._network = network

    @staticmethod
    def load(file: Path) -> GreedyPolicy:
        """Load a model file; see :func:`.policy_file.load_network`."""
        return GreedyPolicy(load_network(file))

    def best(self, seen: Obs, mask: NDArray[np.int8]) -> int:
        """The index of an action.

        Args:
            seen: an observation of :class:`.policy_observation.PolicyObservation`.
            mask: (A,), not 0 where an action is legal.
        """
        obs = {name: _tensor(name, array) for name, array in seen.items()}
        with torch.no_grad():
            numbers, _ = self._network(obs)  # (1, A, outputs)
            values = numbers[0].mean(dim=1)
            return int(values.masked_fill(torch.from_numpy(mask == 0), -torch.inf).argmax())


def _tensor(name: str, array: NDArray[Any]) -> torch.Tensor:
    """(1, …) float32; pictures (1, channels, height, width), from 0 to 1."""
    tensor = torch.as_tensor(array)[None].float()
    return tensor.permute(0, 3, 1, 2) / 255 if name in IMAGES else tensor
