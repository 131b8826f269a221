"""The type-wise network as a policy for sb3-contrib's MaskablePPO."""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from sb3_contrib.common.maskable.distributions import MaskableDistribution
from sb3_contrib.common.maskable.policies import MaskableActorCriticPolicy
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.type_aliases import Schedule
from torch import Tensor, nn

from agents.rl.network import TypeNetwork


class TypeFeatures(BaseFeaturesExtractor):
    """(B, actions × outputs + summary): the outputs of :class:`TypeNetwork`, concatenated."""

    def __init__(
        self, observation_space: spaces.Dict, width: int = 64, kind: int = 16, outputs: int = 1
    ) -> None:
        network = TypeNetwork(observation_space, width, kind, outputs)
        super().__init__(observation_space, network.actions * outputs + network.summary_width)
        self.network = network

    def forward(self, obs: dict[str, Tensor]) -> Tensor:
        """Numbers first, then the summary."""
        numbers, summary = self.network(obs)
        return torch.cat([numbers.flatten(1), summary], dim=1)


class _Split(nn.Module):
    """Splits the features into logits and summary, as Stable-Baselines3's policies expect."""

    def __init__(self, logits: int, summary: int) -> None:
        super().__init__()
        self.latent_dim_pi, self.latent_dim_vf = logits, summary

    def forward(self, features: Tensor) -> tuple[Tensor, Tensor]:
        return self.forward_actor(features), self.forward_critic(features)

    def forward_actor(self, features: Tensor) -> Tensor:
        return features[:, : self.latent_dim_pi]

    def forward_critic(self, features: Tensor) -> Tensor:
        return features[:, self.latent_dim_pi :]


class TypePolicy(MaskableActorCriticPolicy):
    """Logits and value from one :class:`TypeNetwork`; ``policy_kwargs``: ``width``, ``kind``."""

    # These modules replace those that Stable-Baselines3 makes.
    mlp_extractor: _Split  # type: ignore[assignment]
    value_net: nn.Sequential  # type: ignore[assignment]

    def __init__(self, *args: Any, width: int = 64, kind: int = 16, **kwargs: Any) -> None:
        self._shape = {"width": width, "kind": kind}
        super().__init__(
            *args,
            **{
                **kwargs,
                "features_extractor_class": TypeFeatures,
                "features_extractor_kwargs": self._shape,
            },
        )

    def _build(self, lr_schedule: Schedule) -> None:
        assert isinstance(self.features_extractor, TypeFeatures)
        network = self.features_extractor.network
        self.mlp_extractor = _Split(network.actions, network.summary_width)
        self.action_net = nn.Identity()
        value = nn.Linear(network.width, 1)
        self.value_net = nn.Sequential(
            nn.Linear(network.summary_width, network.width), nn.ReLU(), value
        )
        for last in (network.each, network.bare, value):
            with torch.no_grad():
                last.weight.mul_(0.1)  # start with a nearly uniform policy
        settings: dict[str, Any] = {"lr": lr_schedule(1), **self.optimizer_kwargs}
        self.optimizer = self.optimizer_class(self.parameters(), **settings)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), **self._shape}

    def _get_action_dist_from_latent(self, latent_pi: Tensor) -> MaskableDistribution:
        return self.action_dist.proba_distribution(action_logits=latent_pi)


def outputs(policy: Any, obs: Any, legal: Any) -> tuple[MaskableDistribution, Tensor]:
    """The distribution over actions, and the values (B, 1), in one pass through the network; the
    policy's own methods would need two."""
    features = policy.extract_features(obs)
    actor, critic = policy.mlp_extractor(features)
    distribution: MaskableDistribution = policy._get_action_dist_from_latent(actor)
    distribution.apply_masking(legal)
    return distribution, policy.value_net(critic)
