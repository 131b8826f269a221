"""The settings of an ablation: one validated YAML file, ``configs/ablations/NAME.yaml``."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from agents.configs import StrictSettings
from benchmarks.study.settings import (
    Collected,
    Evaluation,
    PlaySettings,
    TeacherData,
)

Name = Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 +,.-]*$")]
"""Names of rows and the like are also names of directories."""


class Source(StrictSettings):
    """A collection from which rows learn; one of the two.

    Attributes:
        collect: what the data engine gives.
        teacher: what another agent gives.
    """

    collect: Collected | None = None
    teacher: TeacherData | None = None

    @model_validator(mode="after")
    def _one(self) -> Source:
        if (self.collect is None) == (self.teacher is None):
            raise ValueError("give either collect or teacher")
        return self


class Step(StrictSettings):
    """One fine-tuning.

    Attributes:
        data: the names of collections.
        set: overrides of the fine-tuning configuration, after the ablation's.
    """

    data: tuple[Name, ...] = Field(min_length=1)
    set: tuple[str, ...] = ()


class Row(StrictSettings):
    """A model, and how it comes about.

    Attributes:
        steps: fine-tunings, each of the model of the one before.
        dialect: another dialect than the ablation's; "" for that.
    """

    steps: tuple[Step, ...] = Field(min_length=1)
    dialect: str = ""


class Compared(StrictSettings):
    """Rows that are compared.

    Attributes:
        title: of its table.
        rows: their names; the others are compared with the first.
        axis: what ``numbers`` has of each row, such as its trajectories. With these a picture shows
            success over the numbers, on a logarithmic scale.
    """

    title: str
    rows: tuple[Name, ...] = Field(min_length=2)
    axis: str = ""
    numbers: tuple[Annotated[float, Field(gt=0)], ...] = ()

    @model_validator(mode="after")
    def _a_number_for_each_row(self) -> Compared:
        if self.numbers and len(self.numbers) != len(self.rows):
            raise ValueError(
                f"{len(self.numbers)} numbers for {len(self.rows)} rows; give one each"
            )
        return self


class AblationSettings(PlaySettings):
    """An ablation.

    Attributes:
        architecture: of every model; its tokenizer is learnt from the collection ``words``.
        words: the name of a collection.
        finetune: a fine-tuning configuration, and ``set`` overrides of it.
        seeds: of weights and of the order of the data; each row is trained with each of them.
        collections: what is learnt from, by name.
        rows: the models, by name.
        studies: which rows are compared, by name.
        evaluation: how each model is measured.
    """

    architecture: str
    words: Name
    finetune: str
    set: tuple[str, ...] = ()
    seeds: tuple[Annotated[int, Field(ge=0, lt=2**32)], ...] = Field((0,), min_length=1)
    collections: dict[Name, Source] = Field(min_length=1)
    rows: dict[Name, Row] = Field(min_length=1)
    studies: dict[Name, Compared] = Field(min_length=1)
    evaluation: Evaluation = Evaluation()

    @model_validator(mode="after")
    def _names_are_known(self) -> AblationSettings:
        data = (each for row in self.rows.values() for step in row.steps for each in step.data)
        rows = (each for study in self.studies.values() for each in study.rows)
        for what, names, known in (
            ("collection", (self.words, *data), self.collections),
            ("row", rows, self.rows),
        ):
            for name in names:
                if name not in known:
                    raise ValueError(f"there is no {what} {name!r}; there are: {', '.join(known)}")
        return self
