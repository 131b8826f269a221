"""What a training run is: one YAML file, checked. Imports neither torch nor environments.

Every field has a default or an error that names it; ``er-gym train-rl --config FILE --set
env.types=[single_search]`` overrules any of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from agents import configs
from er_gym.envs.object_selection import EXPLORE
from er_gym.tasks.types import BY_NAME

_WHAT = "training run"
Fraction = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[int, Field(gt=0)]
Rate = Annotated[float, Field(gt=0)]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def _known_types(types: tuple[str, ...]) -> tuple[str, ...]:
    for name in types:
        if name not in BY_NAME:
            raise ValueError(f"unknown type {name!r}; choose of: {', '.join(BY_NAME)}")
    return types


class EnvConfig(_Model):
    """Which episodes are played, and what the agent perceives of them.

    Attributes:
        episodes: a suite's name, a task file, or ``generate`` for the live generator.
        types: of these task types, each as often as any other; all that there are where empty.
        obs_mode: ``state``, or ``rgb+state``.
        instruction: the encoder of the instruction, as
            :func:`er_gym.envs.wrappers.make_encoder` has it; "" for none, since ``state`` says
            which types it names.
        width, height: of the pictures, pixels.
        frames: how many of the last pictures are seen at once.
        instances: ``explore``, or ``target``, which gives away which object a task is about.
        step_penalty, illegal_penalty: subtracted from the reward, in training only.
        success_bonus: added to it for a success, in training only: what counts in the end is one
            action among many that are worth as much.
        shaping: scale of the potential of key actions left, in training only; 0 for none
            (:class:`er_gym.envs.wrappers.KeyActionShaping`).
        max_steps: an episode's step limit; the task type's own where none is given.
    """

    episodes: str = "train"
    types: tuple[str, ...] = ()
    obs_mode: Literal["state", "rgb+state"] = "state"
    instruction: str = ""
    width: Annotated[int, Field(gt=0, le=2048)] = 128
    height: Annotated[int, Field(gt=0, le=2048)] = 72
    frames: Annotated[int, Field(gt=0, le=64)] = 1
    instances: Literal["explore", "target"] = EXPLORE  # type: ignore[assignment]
    step_penalty: float = Field(0.01, ge=0)
    illegal_penalty: float = Field(0.0, ge=0)
    success_bonus: float = Field(1.0, ge=0)
    shaping: float = Field(0.0, ge=0)
    max_steps: Positive | None = None

    _types = field_validator("types")(_known_types)


class VecEnvConfig(_Model):
    """How many environments, in how many processes."""

    envs: Annotated[int, Field(gt=0, le=4096)] = 128
    workers: Annotated[int, Field(gt=0, le=256)] = 2


class Evaluation(_Model):
    """How it is doing on scenes that it does not train on, every so often.

    Attributes:
        episodes: a suite's name or a task file.
        every: so many steps.
        count: episodes each time.
    """

    episodes: str = "er-1k"
    every: Positive = 100_000
    count: Positive = 100


class Phase(_Model):
    """A part of a curriculum: these task types, until so many steps have been made."""

    until: Positive
    types: tuple[str, ...] = Field(min_length=1)

    _types = field_validator("types")(_known_types)


class WarmStart(_Model):
    """Behaviour cloning before anything else.

    Attributes:
        teacher: who is imitated: ``searcher``, or ``oracle``, which knows the key actions.
        episodes: how many of its are watched.
        successes_only: whether those in which it fails are left out.
        epochs, batch_size, learning_rate: of the supervised training.
    """

    teacher: Literal["searcher", "oracle"] = "searcher"
    episodes: Positive = 2000
    successes_only: bool = True
    epochs: Positive = 5
    batch_size: Positive = 512
    learning_rate: Rate = 1e-3


class Network(_Model):
    """The network: ``width`` of its layers, and length ``kind`` of a type's learnt vector."""

    width: Annotated[int, Field(gt=0, le=8192)] = 64
    kind: Annotated[int, Field(gt=0, le=8192)] = 16


class PPO(_Model):
    """MaskablePPO of sb3-contrib; the names are its own, but for ``final_learning_rate``: the share
    of the learning rate that is left in the end."""

    name: Literal["ppo"] = "ppo"
    learning_rate: Rate = 2e-3
    final_learning_rate: Fraction = 0.1
    n_steps: Positive = 32
    batch_size: Positive = 512
    n_epochs: Positive = 1
    gamma: Fraction = 0.97
    gae_lambda: Fraction = 0.95
    clip_range: Rate = 0.2
    ent_coef: float = Field(0.01, ge=0)
    vf_coef: float = Field(0.5, ge=0)
    max_grad_norm: Rate = 0.5
    target_kl: Rate | None = None


class DQN(_Model):
    """DQN, or QR-DQN with ``quantiles``, over legal actions; the names are Stable-Baselines3's."""

    name: Literal["dqn", "qrdqn"]
    learning_rate: Rate = 1e-3
    buffer_size: Annotated[int, Field(gt=0, le=10_000_000)] = 50_000
    learning_starts: int = Field(5_000, ge=0)
    batch_size: Positive = 128
    gamma: Fraction = 0.97
    train_freq: Positive = 4
    gradient_steps: Positive = 8
    target_update_interval: Positive = 2_000
    exploration_fraction: Fraction = 0.1
    exploration_final_eps: Fraction = 0.05
    max_grad_norm: Rate = 10.0
    quantiles: Annotated[int, Field(gt=0, le=1000)] = 10


Algorithm = Annotated[PPO | DQN, Field(discriminator="name")]


class TrainConfig(_Model):
    """A training run.

    Attributes:
        algorithm: which, and its settings.
        total_steps: environment steps in all; a run goes on to the end of its last rollout.
        seed: of everything that is random. The same seed gives the same policy on the same machine
            with the same ``vec`` and ``threads``, if nothing interrupts it.
        env, vec, evaluation, network: see there.
        curriculum: phases, in order; after the last, ``env.types``.
        warm_start: none where it is not given.
        checkpoint_every: so many steps; at the end of the rollout that passes them.
        threads: of torch, while it learns. More than one helps little with so small a network, and
            costs a lot where something else runs on the same cores.
        tensorboard: whether to write its logs.
        wandb: the project of Weights & Biases to log to as well; "" for none.
    """

    algorithm: Algorithm = PPO()
    total_steps: Positive
    seed: int = Field(0, ge=0, lt=2**32)
    env: EnvConfig = EnvConfig()
    vec: VecEnvConfig = VecEnvConfig()
    evaluation: Evaluation | None = Evaluation()
    curriculum: tuple[Phase, ...] = ()
    warm_start: WarmStart | None = None
    network: Network = Network()
    checkpoint_every: Positive = 50_000
    threads: Annotated[int, Field(gt=0, le=256)] = 1
    tensorboard: bool = True
    wandb: str = ""

    @field_validator("algorithm", mode="before")
    @classmethod
    def _ppo_unless_named(cls, given: Any) -> Any:
        return {"name": "ppo", **given} if isinstance(given, dict) else given

    @model_validator(mode="after")
    def _phases_in_order(self) -> TrainConfig:
        ends = [phase.until for phase in self.curriculum]
        if ends != sorted(set(ends)):
            raise ValueError(f"the phases of a curriculum end at {ends}; let each end later")
        return self

    @model_validator(mode="after")
    def _warm_start_needs_ppo(self) -> TrainConfig:
        if self.warm_start is not None and self.algorithm.name != "ppo":
            raise ValueError(
                f"warm_start goes with ppo, not with {self.algorithm.name}: leave one out"
            )
        return self


def config_names() -> tuple[str, ...]:
    """The names of the runs that come with er-gym, in alphabetical order."""
    return configs.names("rl")


def config_file(name: str) -> Path:
    """The file of a run: a path, or the name of one that comes with er-gym.

    Raises:
        ValueError: there is none; the message lists those that come with er-gym.
    """
    return configs.file_of("rl", name, _WHAT)


def load_config(
    file: Path, overrides: Sequence[str] = (), more: Mapping[str, Any] | None = None
) -> TrainConfig:
    """Read a run's YAML, see :func:`agents.configs.load`.

    Raises:
        ValueError: an override is none, or has no such field; what is given does not fit.
        TaskFileError: the file cannot be read. (It is a ValueError.)
    """
    return configs.load(TrainConfig, file, _WHAT, overrides, more)
