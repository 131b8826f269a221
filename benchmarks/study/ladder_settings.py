"""The settings of a ladder: one validated YAML file, ``configs/ladder/NAME.yaml``."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, field_validator, model_validator

from agents.configs import StrictSettings
from agents.expert.corrections import CorrectAfter
from agents.expert.successors import check_corrector
from agents.finetune.settings import STAGES, Stage
from benchmarks.study.settings import (
    Collected,
    Evaluation,
    PlaySettings,
    Positive,
    TeacherData,
)

Control: TypeAlias = Literal["random", "blind"]
"""The agents to compare with: random actions, or the last model with noise for pictures."""
CONTROLS: tuple[Control, ...] = ("random", "blind")


class Eyes(StrictSettings):
    """Pretraining of the base model's vision on frames, before the first stage.

    Attributes:
        frames: how many are drawn of the suite's rooms (:mod:`er_gym.data.frames`).
        finetune: a fine-tuning configuration.
        set: overrides of it.
    """

    frames: Positive
    finetune: str
    set: tuple[str, ...] = ()


class Base(StrictSettings):
    """The model that the ladder starts from: a model or an architecture.

    Attributes:
        model: a directory with a model in it, or a run of ``er-gym finetune``.
        architecture: a new model of this architecture (:mod:`agents.finetune.architecture`); its
            tokenizer is learnt from the first stage's conversations, and from the frames.
        eyes: pretraining of its vision; None for none.
    """

    model: str = ""
    architecture: str = ""
    eyes: Eyes | None = None

    @model_validator(mode="after")
    def _one(self) -> Base:
        if bool(self.model) == bool(self.architecture):
            raise ValueError("give either model or architecture")
        return self


class Sampled(StrictSettings):
    """Episodes of the last stage's model, from which the stage learns.

    Attributes:
        tasks: how many tasks, spread over the suite.
        skip: how many tasks are left out first, in the same order: those that an earlier stage
            learnt from. A model seldom fails at what it has learnt.
        samples: how many episodes of each.
        temperature, top_p: of the model's replies.
        faults: the rate at which actions fail (:mod:`er_gym.envs.faults`).
        limit: the most trajectories that are taken; None for all.
        correct_after: of its failures, after which action the expert takes over
            (:data:`agents.expert.corrections.CorrectAfter`).
        correct_by: who takes over (:func:`agents.expert.successors.check_corrector`).
        own_thoughts: whether what a correction repeats keeps the thoughts of the agent that failed.
        successes: in the third stage, whether its successes are learnt from, too; those with
            failed actions among them, but for the failed turns.
        earlier: whether the failures among the samples of earlier stages are corrected, too.
        rewrite_thoughts: whether the thoughts of its successes are written anew, since those of a
            weak model are often wrong.
    """

    tasks: Positive
    skip: int = Field(0, ge=0)
    samples: Positive = 1
    temperature: float = Field(1.0, ge=0)
    top_p: float = Field(1.0, gt=0, le=1)
    faults: float = Field(0.0, ge=0, le=1)
    limit: Positive | None = None
    correct_after: CorrectAfter = "wrong"
    correct_by: Annotated[str, AfterValidator(check_corrector)] = "expert"
    own_thoughts: bool = False
    successes: bool = False
    earlier: bool = False
    rewrite_thoughts: bool = False


class StageSettings(StrictSettings):
    """One stage.

    Attributes:
        collect: what the data engine adds; None for nothing.
        teacher: what another agent adds; None for nothing.
        sample: what the model of the stage before adds: its successes in the second stage, its
            corrected failures in the third; None for nothing.
        again: whether the data of earlier stages is learnt from once more.
        finetune: a fine-tuning configuration.
        set: overrides of it.
    """

    collect: Collected | None = None
    teacher: TeacherData | None = None
    sample: Sampled | None = None
    again: bool = False
    finetune: str
    set: tuple[str, ...] = ()


class LadderEvaluation(Evaluation):
    """How the model of each stage is evaluated.

    Attributes:
        faults: fault rates of further evaluations, after the stages from the second on.
        fault_samples: how often each task is played with faults. Other actions go wrong each time,
            so more samples tell more exactly what faults cost.
        base: whether the model at the foot is measured, too.
        controls: who else plays the same tasks, at the end.
        set: overrides of the agent's settings.
    """

    faults: tuple[Annotated[float, Field(gt=0, le=1)], ...] = ()
    fault_samples: Positive = 1
    base: bool = True
    controls: tuple[Control, ...] = ()
    set: tuple[str, ...] = ()


class LadderSettings(PlaySettings):
    """A ladder.

    Attributes:
        base: the model at its foot.
        stages: by name, from the first.
        evaluation: how each rung is measured.
    """

    base: Base
    stages: dict[Stage, StageSettings] = Field(min_length=1)
    evaluation: LadderEvaluation = LadderEvaluation()

    @field_validator("stages")
    @classmethod
    def _in_order(cls, stages: dict[Stage, StageSettings]) -> dict[Stage, StageSettings]:
        first = STAGES[: len(stages)]
        if set(stages) != set(first):
            raise ValueError(
                f"the stages are {', '.join(stages)}; give the first ones of {', '.join(STAGES)}"
            )
        return {name: stages[name] for name in first}

    @model_validator(mode="after")
    def _pictures_for_eyes(self) -> LadderSettings:
        if "blind" in self.evaluation.controls and not self.pictures:
            raise ValueError("the control blind needs pictures; leave it out")
        if self.base.eyes is not None and not self.pictures:
            raise ValueError("base.eyes needs pictures; set pictures to true, or leave out eyes")
        return self

    @model_validator(mode="after")
    def _something_to_learn(self) -> LadderSettings:
        for number, (name, stage) in enumerate(self.stages.items()):
            if not number and stage.sample:
                raise ValueError(f"{name} has no model before it; let it collect, not sample")
            if name == STAGES[2] and stage.sample and _rewrites_nothing(stage.sample):
                raise ValueError(
                    f"{name} puts failures right; leave out rewrite_thoughts, or set successes"
                )
            if name != STAGES[2] and stage.sample and (given := _of_corrections(stage.sample)):
                raise ValueError(f"{name} corrects nothing; leave out {' and '.join(given)}")
            if not (stage.collect or stage.teacher or stage.sample):
                raise ValueError(f"{name} learns from nothing; give it collect, teacher or sample")
        return self


def _of_corrections(sample: Sampled) -> list[str]:
    """The settings that only a stage with corrections may have and that differ from the default."""
    names = ("correct_after", "correct_by", "own_thoughts", "successes", "earlier")
    return [name for name in names if getattr(sample, name) != Sampled.model_fields[name].default]


def _rewrites_nothing(sample: Sampled) -> bool:
    """Whether the third stage would take no success whose thoughts could be written anew."""
    return sample.rewrite_thoughts and not sample.successes
