"""The configuration of a training run: one validated YAML file. Imports neither torch nor
environments.

Every field has a default, or an error names it. ``er-gym train-rl --config FILE --set
env.types=[single_search]`` overrides a field.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from agents.configs import ConfigKind, StrictSettings, load
from agents.rl.guidance import Fraction, NearGoal, Phase, Positive, Rate, Start, WarmStart
from er_gym.envs.object_selection import EXPLORE
from er_gym.tasks.types import canonical_names

_WHAT = "training run"


class EnvConfig(StrictSettings):
    """The episodes, the observations and the reward.

    Attributes:
        episodes: a suite's name, a task file, or ``generate`` for newly generated tasks.
        types: the task types, drawn with equal probability; all types if empty.
        obs_mode: ``state``, with ``rgb`` or ``depth`` or both before it. (``instance`` is not
            offered: its numbers only name objects, so a network cannot calculate with them.)
        subtasks: whether the policy also observes the current subtask of the instruction, and where
            it has searched for its object (:mod:`agents.rl.subtask_memory`).
        sightings: whether it also observes where the things of the subtask were seen, also from
            afar, and how many objects of each type (:mod:`agents.rl.sighting_memory`); with
            ``subtasks``.
        only_from_source: whether it picks up a thing only from where the instruction says that it
            lies, as far as it sees: "the Vase that is on the SideTable" is not the one on the
            CoffeeTable. With ``instances="explore"`` to pick up takes the nearest one; while that
            lies elsewhere, the policy cannot. With ``sightings``.
        instruction: the encoder of the instruction, as
            :func:`er_gym.envs.wrappers.make_encoder` has it; "" for none, since ``state`` says
            which types it names.
        width, height: of the pictures, pixels.
        frames: the number of stacked pictures.
        instances: ``explore``, or ``target``, which gives away which object a task is about.
        step_penalty, illegal_penalty: subtracted from the reward, in training only.
        key_actions: what a key action is worth, in training only.
        success_bonus: added to the reward for a success, in training only, since the last key
            action alone is worth no more than any other.
        shaping: scale of the potential of the key actions left, in training only; 0 for none
            (:class:`er_gym.envs.wrappers.KeyActionShaping`).
        reward: a wrapper that changes the reward, in training only: ``package.module:Name``, or the
            name of an entry point (:mod:`agents.rl.rewards`); "" for none.
        faults: the rate at which actions go wrong (:mod:`er_gym.envs.faults`), in training only.
        max_steps: the step limit of an episode; None for the task type's own.
    """

    episodes: str = "train"
    types: tuple[str, ...] = ()
    obs_mode: Literal["state", "rgb+state", "depth+state", "rgb+depth+state"] = "state"
    subtasks: bool = False
    sightings: bool = False
    only_from_source: bool = False
    instruction: str = ""
    width: Annotated[int, Field(gt=0, le=2048)] = 128
    height: Annotated[int, Field(gt=0, le=2048)] = 72
    frames: Annotated[int, Field(gt=0, le=64)] = 1
    instances: Literal["explore", "target"] = EXPLORE  # type: ignore[assignment]
    step_penalty: float = Field(0.01, ge=0)
    illegal_penalty: float = Field(0.0, ge=0)
    key_actions: float = Field(1.0, ge=0)
    success_bonus: float = Field(1.0, ge=0)
    shaping: float = Field(0.0, ge=0)
    reward: str = ""
    faults: float = Field(0.0, ge=0, le=1)
    max_steps: Positive | None = None

    _types = field_validator("types")(canonical_names)

    @model_validator(mode="after")
    def _each_needs_another(self) -> EnvConfig:
        if self.sightings and not self.subtasks:
            raise ValueError(
                "sightings are of the things of the subtask at hand: give subtasks=true, too"
            )
        if self.only_from_source and not self.sightings:
            raise ValueError("only_from_source goes by sightings: give sightings=true, too")
        if self.only_from_source and self.instances != EXPLORE:
            raise ValueError(
                f"only_from_source is for instances={EXPLORE}: with {self.instances} the "
                "environment picks up what the task means"
            )
        return self

    @property
    def needed_obs_mode(self) -> str:
        """The observations that the environment must give, as its ``obs_mode``."""
        return f"{self.obs_mode}+objects" if self.sightings else self.obs_mode


class VecEnvConfig(StrictSettings):
    """The number of environments and of worker processes."""

    envs: Annotated[int, Field(gt=0, le=4096)] = 128
    workers: Annotated[int, Field(gt=0, le=256)] = 2


class Evaluation(StrictSettings):
    """Regular evaluation on held-out scenes.

    Attributes:
        episodes: a suite's name or a task file.
        every: steps between two evaluations.
        count: episodes per evaluation.
    """

    episodes: str = "er-1k"
    every: Positive = 100_000
    count: Positive = 100


class Network(StrictSettings):
    """The network: the ``width`` of its layers, and the length ``kind`` of an object type's
    embedding."""

    width: Annotated[int, Field(gt=0, le=8192)] = 64
    kind: Annotated[int, Field(gt=0, le=8192)] = 16


class PPO(StrictSettings):
    """MaskablePPO of sb3-contrib, with its parameter names. ``final_learning_rate`` is added: the
    share of the learning rate that remains at the end."""

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


class DQN(StrictSettings):
    """DQN, or QR-DQN with ``quantiles``, over legal actions, with Stable-Baselines3's parameter
    names."""

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


class TrainConfig(StrictSettings):
    """A training run.

    Attributes:
        algorithm: the algorithm and its parameters.
        total_steps: environment steps of reinforcement learning in all; a run completes its last
            rollout. 0 for the warm start alone.
        seed: of all random choices. The same seed gives the same policy on the same machine with
            the same ``vec`` and ``threads``, if the run is not interrupted.
        env, vec, evaluation, network: see their classes.
        curriculum: phases in order; ``env.types`` follow after the last.
        near_goal: a curriculum of the key actions that are left at the start; None for none.
        warm_start: behaviour cloning; None for none.
        start: a trained policy to go on from, in place of a warm start; None for none.
        checkpoint_every: steps between two checkpoints; a checkpoint is written after the rollout.
        threads: torch's threads for updates. More than one helps little with so small a network,
            and costs much if other processes need the cores.
        tensorboard: whether to write TensorBoard logs.
        wandb: the Weights & Biases project to log to; "" for none.
    """

    algorithm: Algorithm = PPO()
    total_steps: int = Field(ge=0)
    seed: int = Field(0, ge=0, lt=2**32)
    env: EnvConfig = EnvConfig()
    vec: VecEnvConfig = VecEnvConfig()
    evaluation: Evaluation | None = Evaluation()
    curriculum: tuple[Phase, ...] = ()
    near_goal: NearGoal | None = None
    warm_start: WarmStart | None = None
    start: Start | None = None
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
            raise ValueError(
                f"the phases of a curriculum end at {ends}; each must end after the one before it"
            )
        return self

    @model_validator(mode="after")
    def _a_teacher_needs_ppo(self) -> TrainConfig:
        for name in ("warm_start", "start"):
            if getattr(self, name) is not None and self.algorithm.name != "ppo":
                raise ValueError(
                    f"{name} goes with ppo, not with {self.algorithm.name}: leave one out"
                )
        return self

    @model_validator(mode="after")
    def _one_beginning(self) -> TrainConfig:
        if self.warm_start is not None and self.start is not None:
            raise ValueError("warm_start and start are two ways to begin: leave one out")
        return self

    @model_validator(mode="after")
    def _no_steps_need_the_warm_start(self) -> TrainConfig:
        if not self.total_steps and self.warm_start is None:
            raise ValueError("total_steps is 0 and there is no warm_start: give one of them")
        return self

    @model_validator(mode="after")
    def _practice_needs_the_searcher(self) -> TrainConfig:
        if self.warm_start is None or self.warm_start.practice is None:
            return self
        if self.warm_start.teacher != "searcher" or not self.env.subtasks:
            raise ValueError(
                "warm_start.practice goes with the teacher searcher and env.subtasks=true, not "
                f"with {self.warm_start.teacher} and {str(self.env.subtasks).lower()}: change "
                "these, or leave it out"
            )
        return self


CONFIGS = ConfigKind(TrainConfig, "rl", _WHAT)
config_names, config_file = CONFIGS.names, CONFIGS.file

ALGORITHM_NAMES = {
    "ppo": "MaskablePPO",
    "dqn": "DQN over legal actions",
    "qrdqn": "QR-DQN over legal actions",
}
"""How people call the algorithms."""


def how_learnt(config: TrainConfig, steps: int) -> str:
    """How a policy was trained, in words.

    Args:
        config: of its training.
        steps: of the algorithm, which may be 0 after a warm start.
    """
    parts = []
    if warm := config.warm_start:
        parts.append(f"{warm.episodes:,} cloned episodes of the {warm.teacher}")
        if practice := warm.practice:
            parts.append(f"{practice.rounds} rounds of DAgger of {practice.steps:,} steps")
    if config.start:
        parts.append(f"the weights of {config.start.policy}")
    if steps or not parts:
        parts.append(f"{steps:,} steps of {ALGORITHM_NAMES[config.algorithm.name]}")
    more = (("subtask", config.env.subtasks), ("sightings", config.env.sightings))
    observed = " and ".join([config.env.obs_mode, *(name for name, given in more if given)])
    return f"{', then '.join(parts)} on {observed}"


def load_config(
    file: Path, overrides: Sequence[str] = (), more: Mapping[str, Any] | None = None
) -> TrainConfig:
    """Read a run's YAML, see :func:`agents.configs.load`.

    Raises:
        ValueError: an override has no ``=`` or names an unknown field, or a value is invalid.
        TaskFileError: the file cannot be read. (It is a ValueError.)
    """
    return load(TrainConfig, file, _WHAT, overrides, more)
