"""DQN and QR-DQN over the legal actions (Stable-Baselines3, sb3-contrib).

The observation holds the action mask under ``mask``. Illegal actions get a very low value, also in
the target's maximum, and are never explored.

A continued run begins with an empty replay buffer: it plays ``learning_starts`` steps with its last
    policy before it learns again.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from sb3_contrib import QRDQN
from sb3_contrib.qrdqn.policies import QRDQNPolicy
from stable_baselines3 import DQN
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.policies import BasePolicy
from stable_baselines3.common.preprocessing import preprocess_obs
from stable_baselines3.common.type_aliases import PyTorchObs
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.dqn.policies import DQNPolicy
from torch import Tensor, nn

from agents.rl.config import DQN as DQNSettings
from agents.rl.config import TrainConfig
from agents.rl.network import TypeNetwork
from agents.rl.policy_observation import Obs

_NEVER = -1e6
"""The value of an illegal action. It is finite, since it is multiplied by 0 at the end of an
episode."""
_LOG_EVERY = 100
"""Episodes between two lines of the curve; its means cover as many."""


# -- the network ---------------------------------------------------------------------------------


class QuantileNetwork(BasePolicy):
    """N quantiles of the return of each action: the state's quantiles, which all actions share,
    plus the action's advantage for each."""

    def __init__(
        self, space: spaces.Dict, actions: spaces.Discrete, width: int, kind: int, quantiles: int
    ) -> None:
        super().__init__(space, actions)
        self.network = TypeNetwork(space, width, kind, quantiles)
        value = nn.Linear(width, quantiles)
        self.value = nn.Sequential(nn.Linear(self.network.summary_width, width), nn.ReLU(), value)
        for last in (self.network.each, self.network.bare, value):
            with torch.no_grad():
                last.weight.mul_(0.1)  # start with values near 0

    def forward(self, obs: PyTorchObs) -> Tensor:
        """(B, N, A) quantiles; very low for illegal actions."""
        seen = preprocess_obs(obs, self.observation_space)
        assert isinstance(seen, dict)
        more, summary = self.network(seen)  # (B, A, N), (B, summary)
        quantiles = more + self.value(summary)[:, None]
        illegal = seen["mask"] == 0  # (B, A)
        return quantiles.masked_fill_(illegal[:, :, None], _NEVER).transpose(1, 2)

    def _predict(self, observation: PyTorchObs, deterministic: bool = True) -> Tensor:
        return self(observation).mean(dim=1).argmax(dim=1)


class ValueNetwork(QuantileNetwork):
    """The expected return of each action."""

    def forward(self, obs: PyTorchObs) -> Tensor:
        """(B, A) values; very low for illegal actions."""
        return super().forward(obs)[:, 0]

    def _predict(self, observation: PyTorchObs, deterministic: bool = True) -> Tensor:
        return self(observation).argmax(dim=1)


def _spaces(policy: BasePolicy) -> tuple[spaces.Dict, spaces.Discrete]:
    assert isinstance(policy.observation_space, spaces.Dict)
    assert isinstance(policy.action_space, spaces.Discrete)
    return policy.observation_space, policy.action_space


class _TypeWise(BasePolicy):
    """Gives a policy the parameters of :class:`TypeNetwork`. Inherit from it before the policy."""

    def __init__(self, *args: Any, width: int = 64, kind: int = 16, **kwargs: Any) -> None:
        self._shape = {"width": width, "kind": kind}
        super().__init__(*args, **kwargs)

    def _get_constructor_parameters(self) -> dict[str, Any]:
        return {**super()._get_constructor_parameters(), **self._shape}


class TypeDQNPolicy(_TypeWise, DQNPolicy):
    """``policy_kwargs``: ``width``, ``kind``."""

    # Our network in place of Stable-Baselines3's own, which only needs to be callable.
    def make_q_net(self) -> ValueNetwork:  # type: ignore[override]
        """Make a network, online or target."""
        seen, actions = _spaces(self)
        return ValueNetwork(seen, actions, **self._shape, quantiles=1).to(self.device)


class TypeQRDQNPolicy(_TypeWise, QRDQNPolicy):
    """``policy_kwargs``: ``width``, ``kind``, ``n_quantiles``."""

    # As above.
    def make_quantile_net(self) -> QuantileNetwork:  # type: ignore[override]
        """Make a network, online or target."""
        seen, actions = _spaces(self)
        network = QuantileNetwork(seen, actions, **self._shape, quantiles=self.n_quantiles)
        return network.to(self.device)


# -- the buffer ----------------------------------------------------------------------------------


class HalfReplayBuffer(DictReplayBuffer):
    """Stores floats, which are in [-1, 1], as float16; the policy converts them back to float32.

    A transition of ``state`` (2259,) and ``mask`` (286,), before and after, takes 9.6 kB, 50 000 of
    them 480 MB, rather than 930 MB in float32. Pictures of 128 × 72 add 55 kB to each.
    """

    def __init__(
        self, buffer_size: int, observation_space: spaces.Dict, *args: Any, **kwargs: Any
    ) -> None:
        kept = {
            key: spaces.Box(-1.0, 1.0, box.shape, np.float16) if box.dtype == np.float32 else box
            for key, box in observation_space.items()
        }
        super().__init__(buffer_size, spaces.Dict(kept), *args, **kwargs)


# -- the algorithms ------------------------------------------------------------------------------


class _Legal(OffPolicyAlgorithm):
    """Explores legal actions, independently in each environment, and learns from a filled buffer.

    A mixin: inherit from it before DQN or QRDQN.
    """

    exploration_rate: float

    def predict(
        self,
        observation: NDArray[Any] | Obs,
        state: tuple[NDArray[Any], ...] | None = None,
        episode_start: NDArray[Any] | None = None,
        deterministic: bool = False,
        action_masks: Any = None,
    ) -> tuple[NDArray[Any], tuple[NDArray[Any], ...] | None]:
        """The best action or an exploratory one. Masks are read from the observation;
        ``action_masks``, which sb3-contrib's evaluation passes to every learner, is ignored."""
        return self._act(observation, 0.0 if deterministic else self.exploration_rate), state

    def _sample_action(
        self, learning_starts: int, action_noise: Any = None, n_envs: int = 1
    ) -> tuple[NDArray[Any], NDArray[Any]]:
        filling = self.num_timesteps < learning_starts
        assert self._last_obs is not None
        actions = self._act(self._last_obs, 1.0 if filling else self.exploration_rate)
        return actions, actions

    def _act(self, obs: NDArray[Any] | Obs, exploration_rate: float) -> NDArray[Any]:
        assert isinstance(obs, dict)  # it tells the action mask
        best, _ = self.policy.predict(obs, deterministic=True)
        lots = obs["mask"] * (1 - np.random.random(obs["mask"].shape))  # (n, A), above 0 if legal
        tries = np.random.random(best.shape) < exploration_rate
        return np.where(tries, lots.argmax(axis=-1), best)

    def train(self, gradient_steps: int, batch_size: int = 100) -> None:
        """Learn, unless the buffer has fewer than ``learning_starts`` steps, as in a continued
        run."""
        buffer = self.replay_buffer
        assert buffer is not None
        if buffer.full or buffer.size() * buffer.n_envs >= self.learning_starts:
            super().train(gradient_steps, batch_size)

    def learn(self, *args: Any, **kwargs: Any) -> Any:
        """See Stable-Baselines3; logs every 100 episodes by default."""
        return super().learn(*args, **{"log_interval": _LOG_EVERY, **kwargs})


class LegalDQN(_Legal, DQN):
    """DQN over the legal actions."""


class LegalQRDQN(_Legal, QRDQN):
    """QR-DQN, which learns the distribution of returns, over the legal actions."""


def make(config: TrainConfig, settings: DQNSettings, env: VecEnv) -> BaseAlgorithm:
    """Make an untrained learner: DQN or QR-DQN, by ``settings.name``."""
    policy_kwargs = config.network.model_dump()
    if settings.name == "qrdqn":
        policy_kwargs["n_quantiles"] = settings.quantiles
    given: dict[str, Any] = {
        **settings.model_dump(exclude={"name", "quantiles"}),
        "replay_buffer_class": HalfReplayBuffer,
        "policy_kwargs": policy_kwargs,
        "seed": config.seed,
        "device": "cpu",
    }
    if settings.name == "qrdqn":
        return LegalQRDQN(TypeQRDQNPolicy, env, **given)
    return LegalDQN(TypeDQNPolicy, env, **given)
