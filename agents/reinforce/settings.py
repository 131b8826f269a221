"""The settings of a reinforcement run: one validated YAML file. Imports no model library.

er-gym's own files are ``configs/reinforce/NAME.yaml``. Every field has a default. ``er-gym
reinforce --config er-tiny-text --set training.updates=10`` overrides a field.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from agents.configs import ConfigKind, StrictSettings
from agents.finetune.settings import Fraction, ModelSettings, Positive, Rate
from er_gym.tasks.types import canonical_names

Weight = Annotated[float, Field(ge=-1_000, le=1_000)]


class PlaySettings(StrictSettings):
    """How the episodes are played that the model learns from.

    Attributes:
        tasks: how many tasks of the suite are played before each update, by all processes together.
        group: how often each of them is played: the episodes that are compared with each other.
        starts: where these episodes begin. At the ``beginning``; or each task is played once, and
            they go on from there right after a ``refusal``: an action that was not possible, or a
            reply that named none.
        places: from how many refusals of an episode groups go on, at most; each is a group.
        turns: how many turns they go on at most; None for as many as the episode has left.
        temperature: at which replies are drawn. Ratios are of the model at this temperature.
        max_tokens: the most tokens of a reply; None for what the model was tuned for.
        concurrency: the most conversations at once in a process.
        workers: in how many processes beside it the environments run.
        env: arguments of the environment in place of the suite's, such as ``instances``.
    """

    tasks: Positive = 16
    group: Positive = 8
    starts: Literal["beginning", "refusal"] = "beginning"
    places: Positive = 1
    turns: Positive | None = None
    temperature: float = Field(1.0, gt=0, le=10)
    max_tokens: Positive | None = None
    concurrency: Positive = 64
    workers: Positive = 1
    env: Mapping[str, Any] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _goes_on(self) -> PlaySettings:
        if self.starts == "beginning" and (self.places, self.turns) != (1, None):
            raise ValueError(
                "places and turns say how episodes go on from a refusal; set starts=refusal, or "
                "leave them out"
            )
        return self


class CurriculumSettings(StrictSettings):
    """Which tasks are played.

    Attributes:
        types: by any of their names, such as ``single_search``; all of the suite if empty. They are
            also those of validation.
        floor: the least weight of a type of task. A type with the success s (a fraction) weighs
            s · (1 - s) and this: little where nothing or everything succeeds, since there is
            nothing to compare. With a high floor all types are played alike.
        memory: how much of a type's success of before stays with each update.
    """

    types: tuple[str, ...] = ()
    floor: float = Field(0.05, gt=0, le=1_000)
    memory: Fraction = 0.8

    @field_validator("types")
    @classmethod
    def _known(cls, types: tuple[str, ...]) -> tuple[str, ...]:
        return canonical_names(types)


class AdvantageSettings(StrictSettings):
    """How much better than expected a turn was.

    Attributes:
        row: a name of :data:`agents.reinforce.advantages.ADVANTAGES`, or ``package.module:NAME``.
        discount: of later rewards with each turn, for rows that look at turns.
        step_weight: the weight of the step groups beside the episode groups, for ``gigpo``.
        branches: how often an episode is continued from a state, for ``branches``.
        branch_every: of how many turns the first one's state is continued.
    """

    row: str = "rloo"
    discount: Fraction = 1.0
    step_weight: float = Field(1.0, ge=0, le=1_000)
    branches: Positive = 4
    branch_every: Positive = 1


class ObjectiveSettings(StrictSettings):
    """What is maximised.

    Attributes:
        clip, clip_high: how far below and above 1 the ratio of a token's new probability to that at
            play may be rewarded (PPO); ``clip_high`` is None for the same as ``clip``.
        kl: the weight of the divergence from the model at the start.
        entropy: the weight of the entropy of what is said.
        mean: over what the mean is taken: ``token`` (each token counts alike), ``turn`` or
            ``episode`` (each turn or episode counts alike, however many words it has).
        skip_within: groups are left out whose episodes earned the same, or differ by no more than
            this; None to leave out none.
        most: of how many episodes of a group is learnt, those that differ most in what they earned;
            None for all. To learn from an episode takes about as long as to play it.
    """

    clip: float = Field(0.2, gt=0, lt=1)
    clip_high: float | None = Field(0.28, gt=0, le=10)
    kl: float = Field(0.0, ge=0, le=1_000)
    entropy: float = Field(0.0, ge=-1_000, le=1_000)
    mean: Literal["token", "turn", "episode"] = "token"
    skip_within: float | None = Field(0.0, ge=0, le=1_000)
    most: int | None = Field(None, ge=2, le=100_000)


class TrainingSettings(StrictSettings):
    """How the model is trained.

    Attributes:
        updates: how often episodes are played and learnt from.
        passes: how often the episodes of an update are gone through.
        steps: of the optimizer in a pass; each has as many conversations.
        batch: conversations a device and forward pass; it changes memory and speed alone.
        learning_rate: after ``warmup`` updates in which it rises.
        decay: whether it falls to 0 in a straight line until the last update.
        weight_decay, max_grad_norm: of the optimizer.
        optimizer: as in fine-tuning (:class:`agents.finetune.settings.TrainingSettings`).
        checkpointing: whether activations are computed again instead of stored.
        save_every: in updates. A checkpoint is also written at the end.
        keep: how many checkpoints stay.
        seed: of tasks, of what is drawn, and of new weights.
    """

    updates: Positive = 100
    passes: Positive = 1
    steps: Positive = 1
    batch: Positive = 2
    learning_rate: Rate = 1e-5
    warmup: int = Field(0, ge=0, le=1_000_000)
    decay: bool = False
    weight_decay: Fraction = 0.0
    max_grad_norm: float = Field(1.0, gt=0)
    optimizer: Literal["adamw", "muon"] = "adamw"
    checkpointing: bool = False
    save_every: Positive = 10
    keep: Positive = 1
    seed: int = Field(0, ge=0, lt=2**32)


class ValidationSettings(StrictSettings):
    """The tasks by which one sees how far the model has come, and chooses among its updates.

    Attributes:
        suite: its name.
        tasks: how many, drawn at random, always the same; 0 for no validation.
        every: in updates; also before the first and after the last.
        best: whether the result is the model of the update that did best; otherwise of the last.
    """

    suite: str = "er-val"
    tasks: int = Field(0, ge=0, le=100_000)
    every: Positive = 20
    best: bool = False


class ReinforceSettings(StrictSettings):
    """A reinforcement run.

    Attributes:
        rewards: the weight of each reward by name
            (:data:`agents.reinforce.rewards.REWARDS`, or ``package.module:NAME``).
        model: which part of it learns, as in fine-tuning.
        play, curriculum, advantage, objective, training, validation: see their classes.
    """

    rewards: Mapping[str, Weight] = Field(default={"success": 1.0}, min_length=1)
    model: ModelSettings = ModelSettings()
    play: PlaySettings = PlaySettings()
    curriculum: CurriculumSettings = CurriculumSettings()
    advantage: AdvantageSettings = AdvantageSettings()
    objective: ObjectiveSettings = ObjectiveSettings()
    training: TrainingSettings = TrainingSettings()
    validation: ValidationSettings = ValidationSettings()

    @field_validator("model")
    @classmethod
    def _without_dropout(cls, model: ModelSettings) -> ModelSettings:
        if model.lora is not None and model.lora.dropout:
            raise ValueError(
                "lora.dropout makes the model that learns another one than the model that plays; "
                "set it to 0"
            )
        return model


load_settings = ConfigKind(ReinforceSettings, "reinforce", "reinforcement run").load
