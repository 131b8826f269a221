"""The card of a model: what it is, what it was trained on, and how well it plays."""

from __future__ import annotations

import datetime
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import yaml
from pydantic import BaseModel, ConfigDict, Field

from er_gym.tasks.files import validated
from er_gym.tasks.reading import read_yaml
from er_gym.writing import YAML_MARK

LICENCE = "Apache-2.0"
"""The project's own."""
Kind: TypeAlias = Literal["policy", "language model"]
Percent = Annotated[float, Field(ge=0, le=100)]


class _Card(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Rate(_Card):
    """A rate of success.

    Attributes:
        n, successes: episodes.
        percent, low, high: the rate and its 95 % interval (Wilson's), in %.
    """

    n: Annotated[int, Field(gt=0)]
    successes: Annotated[int, Field(ge=0)]
    percent: Percent
    low: Percent
    high: Percent


class Figure(_Card):
    """A run of ``er-gym bench``, by the corrected scorer.

    Attributes:
        suite: the suite's name.
        options: the further options of the run that choose its tasks and its rules.
        played_by: the agent: ``zoo:NAME`` for the weights of the folder, ``run`` for those of the
            training run, which may be more exact.
        date: the day on which the run ended, in UTC.
        er_gym: the version that played.
        success: over all episodes.
        groups: for each group of task types that was played.
    """

    suite: str
    options: str
    played_by: str
    date: datetime.date
    er_gym: str
    success: Rate
    groups: dict[str, Rate]


class Card(_Card):
    """The facts about a model.

    Attributes:
        format: the version of this layout.
        title: what the model does, in a few words.
        kind: ``policy`` plays as ``rl:`` does, ``language model`` as ``hf:`` does.
        parameters: the number of its weights.
        dtype: of the weights in the folder.
        bytes: of the folder's files without the card.
        trained_on: what it has learnt from.
        licence: of the weights.
        er_gym: the version that packed it.
        figures: how well it plays.
        made_by: the commands that train it again.
    """

    format: Literal["er-gym/zoo/1"] = "er-gym/zoo/1"
    title: str
    kind: Kind
    parameters: Annotated[int, Field(gt=0)]
    dtype: str
    bytes: Annotated[int, Field(gt=0)]
    trained_on: str
    licence: str = LICENCE
    er_gym: str
    figures: tuple[Figure, ...] = ()
    made_by: Annotated[tuple[str, ...], Field(min_length=1)]


def read_card(file: Path) -> Card:
    """Read a card.

    Raises:
        TaskFileError: it is no card; the message names the file and the problem.
    """
    return validated(Card, read_yaml(file), f"{file}: the card")


def card_text(card: Card) -> str:
    """A card as YAML."""
    told = card.model_dump(mode="json")
    for figure in told["figures"]:
        figure["date"] = datetime.date.fromisoformat(figure["date"])
    return YAML_MARK + yaml.safe_dump(told, sort_keys=False, allow_unicode=True, width=100)
