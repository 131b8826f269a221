"""MaskablePPO that goes on from a trained policy: first its value function learns, then the policy,
kept near to where it started.

A policy that imitates is good, and knows nothing of what states are worth. The first updates by an
untrained value function would be noise, and undo it. So the policy plays unchanged until the value
function has learnt. From then on the loss has the divergence KL(start || policy), with a weight
that falls: what the start would do stays likely, and something better may be tried beside it
(kickstarting, arXiv 1803.03835).
"""

from __future__ import annotations

from copy import deepcopy
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch
from sb3_contrib import MaskablePPO
from stable_baselines3.common.utils import explained_variance, update_learning_rate
from torch import Tensor
from torch.nn import functional

from agents.rl.config import TrainConfig
from agents.rl.guidance import Start
from agents.rl.network import TypeNetwork
from agents.rl.policy import TypeFeatures, outputs
from agents.rl.policy_file import CONFIG, load_network, policy_file, untrained_network
from agents.zoo.index import PREFIX, find_model

_NEVER = -1e8
"""The logit of an illegal action, as in sb3-contrib."""


class AnchoredPPO(MaskablePPO):
    """MaskablePPO with a start.

    Args:
        start: its settings.

    Attributes:
        anchor: the network of the start; :meth:`begin_from` sets it, or a checkpoint.
    """

    def __init__(self, *args: Any, start: Start, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._start = start
        extractor: Any = self.policy.features_extractor
        self.anchor: TypeFeatures = deepcopy(extractor).requires_grad_(False).eval()

    def begin_from(self, network: TypeNetwork) -> None:
        """Take over the weights of a trained network."""
        extractor: Any = self.policy.features_extractor
        for mine in (extractor, self.anchor):
            mine.network.load_state_dict(network.state_dict())

    def train(self) -> None:
        """Learn from the rollout: the value function alone at first, then all."""
        self.policy.set_training_mode(True)
        self._update_learning_rate(self.policy.optimizer)
        values_first = self.num_timesteps <= self._start.value_steps
        if values_first:
            rate = self._start.value_learning_rate
            update_learning_rate(self.policy.optimizer, rate)
            self.logger.record("train/learning_rate", rate)
        weight = 0.0 if values_first else self._start.kl_weight(self.num_timesteps)
        clip: float = self.clip_range(self._current_progress_remaining)  # type: ignore[operator]
        loss_of = self._value_loss if values_first else partial(self._loss, clip, weight)
        told: list[dict[str, float]] = []
        moved = 0.0
        for _ in range(self.n_epochs):
            for batch in self.rollout_buffer.get(self.batch_size):
                loss, figures = loss_of(batch)
                moved = figures.get("approx_kl", 0.0)
                if self.target_kl is not None and moved > 1.5 * self.target_kl:
                    break
                told.append({"loss": loss.item(), **figures})
                self.policy.optimizer.zero_grad()  # to None: what has no gradient is not touched
                loss.backward()
                torch.nn.utils.clip_grad_norm_(self.policy.parameters(), self.max_grad_norm)
                self.policy.optimizer.step()
            self._n_updates += 1
            if self.target_kl is not None and moved > 1.5 * self.target_kl:
                break
        buffer = self.rollout_buffer
        explained = explained_variance(buffer.values.flatten(), buffer.returns.flatten())
        self.logger.record("train/explained_variance", explained)
        self.logger.record("train/n_updates", self._n_updates, exclude="tensorboard")
        self.logger.record("start/kl_weight", weight)
        for name in told[0] if told else ():
            place = "start" if name == "kl" else "train"
            self.logger.record(f"{place}/{name}", float(np.mean([each[name] for each in told])))

    def _value_loss(self, batch: Any) -> tuple[Tensor, dict[str, float]]:
        """That of the value function by itself: its gradient stops at the policy's network."""
        with torch.no_grad():
            features: Any = self.policy.extract_features(batch.observations)
        values = self.policy.value_net(self.policy.mlp_extractor.forward_critic(features))
        loss = functional.mse_loss(values.flatten(), batch.returns)
        return self.vf_coef * loss, {"value_loss": loss.item()}

    def _loss(self, clip: float, weight: float, batch: Any) -> tuple[Tensor, dict[str, float]]:
        """PPO's loss and the divergence from the start, with the figures to log."""
        legal = batch.action_masks
        # sb3-contrib's annotations allow for other distributions than the categorical one.
        both: tuple[Any, Tensor] = outputs(self.policy, batch.observations, legal)
        distribution, values = both
        log_prob = distribution.log_prob(batch.actions.long().flatten())
        gain = batch.advantages
        gain = (gain - gain.mean()) / (gain.std() + 1e-8)
        log_ratio = log_prob - batch.old_log_prob
        ratio = log_ratio.exp()
        surrogate = torch.min(gain * ratio, gain * ratio.clamp(1 - clip, 1 + clip)).mean()
        value_loss = functional.mse_loss(values.flatten(), batch.returns)
        entropy = distribution.entropy().mean()
        loss = self.vf_coef * value_loss - surrogate - self.ent_coef * entropy
        far = divergence(
            self._anchor_logits(batch.observations), distribution.distribution.logits, legal
        ).mean()
        with torch.no_grad():
            figures = {
                "policy_gradient_loss": -surrogate.item(),
                "value_loss": value_loss.item(),
                "entropy_loss": -entropy.item(),
                "approx_kl": (ratio - 1 - log_ratio).mean().item(),
                "clip_fraction": ((ratio - 1).abs() > clip).float().mean().item(),
                "kl": far.item(),
            }
        return loss + weight * far, figures

    def _anchor_logits(self, obs: Any) -> Tensor:
        with torch.no_grad():
            features: Any = self.policy.extract_features(obs, self.anchor)
            return self.policy.mlp_extractor.forward_actor(features)


def divergence(start: Tensor, now: Tensor, legal: Tensor) -> Tensor:
    """KL(start || now) of the probabilities of legal actions.

    Args:
        start, now: (B, A) logits.
        legal: (B, A), not 0 where an action is legal; at least one in each row.

    Returns:
        (B,) nats, 0 or more.
    """
    illegal = legal == 0
    one, other = (each.masked_fill(illegal, _NEVER).log_softmax(dim=1) for each in (start, now))
    return (one.exp() * (one - other)).sum(dim=1)


def policy_folder(name: str) -> Path:
    """Where a policy is: ``zoo:NAME``, a run directory, or a model file.

    Raises:
        ValueError: the zoo has no such model.
    """
    return find_model(name.removeprefix(PREFIX)).folder if name.startswith(PREFIX) else Path(name)


def starting_network(config: TrainConfig, start: Start) -> TypeNetwork:
    """The network of the policy that a run starts from.

    Where the run observes sightings and the policy did not, it does not look at them at first.

    Raises:
        ValueError: there is no such policy, it cannot be read, or it is another network than the
            run's.
    """
    name = start.policy
    path = policy_folder(name)
    try:
        file = policy_file(path)
        network = load_network(file)
    except ValueError as error:
        raise ValueError(f"start.policy {name}: {error}") from error
    mine = untrained_network(config)
    if config.env.sightings:
        network.add_sightings()
    theirs, wanted = network.state_dict(), mine.state_dict()
    if {key: each.shape for key, each in theirs.items()} != {
        key: each.shape for key, each in wanted.items()
    }:
        raise ValueError(
            f"start.policy {name} observes something else than this run, or its network has "
            "another shape: take env (obs_mode, subtasks, sightings, instruction) and network "
            f"from {file.parent / CONFIG}"
        )
    return network
