"""What the settings of all plans have in common."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from agents.configs import StrictSettings
from er_gym.data.trajectory import Language

Positive = Annotated[int, Field(gt=0)]
Pixels = Annotated[int, Field(ge=16, le=4096)]
"""As the options --width and --height take them."""


class Collected(StrictSettings):
    """Trajectories of the data engine.

    Attributes:
        parts: of the recipe.
        limit: how many trajectories.
        recipe: one of ``configs/collections``, or a file.
    """

    parts: tuple[str, ...]
    limit: Positive
    recipe: str = "paper"


class TeacherData(StrictSettings):
    """Successful episodes of a teacher: another agent.

    Attributes:
        agent: as ``er-gym bench`` takes it, such as ``searcher``.
        tasks: how many tasks, spread over the suite.
        skip: how many tasks are left out first, in the same order.
        samples: how many episodes of each.
        faults: the rate at which actions fail (:mod:`er_gym.envs.faults`). Episodes with failed
            actions are taken, too; the failed turns are not learnt from.
        limit: the most trajectories that are taken; None for all.
    """

    agent: str
    tasks: Positive
    skip: int = Field(0, ge=0)
    samples: Positive = 1
    faults: float = Field(0.0, ge=0, le=1)
    limit: Positive | None = None


class Evaluation(StrictSettings):
    """How each model is measured.

    Attributes:
        suite: whose rooms the training did not see.
        limit: how many tasks, spread over the suite; None for all.
    """

    suite: str = "er-1k"
    limit: Positive | None = None


class PlaySettings(StrictSettings):
    """How trajectories are played and put into words, and how models play.

    Attributes:
        description: for people.
        suite: the tasks of the training, and the arguments of ``collect`` beside.
        instances: which object a type name means, ``target`` or ``explore``; "" for the suites' own
            choice.
        dialect, language: of the conversations.
        pictures: whether trajectories are recorded with pictures; a model that reads needs none.
        width, height: of these pictures, pixels; None for the suite's own.
        types: the task types of the training and the evaluation; empty for all.
        seed: of everything that is drawn.
        workers: processes that play.
        concurrency: conversations at once.
        play: overrides of the agent's settings whenever it plays.
    """

    description: str = ""
    suite: str = "train"
    instances: str = "explore"
    dialect: str = "paper"
    language: Language = "en"
    pictures: bool = True
    width: Pixels | None = None
    height: Pixels | None = None
    types: tuple[str, ...] = ()
    seed: int = Field(0, ge=0, lt=2**32)
    workers: Positive = 2
    concurrency: Positive = 8
    play: tuple[str, ...] = ()


FREE = frozenset({"workers", "concurrency", "description"})
"""Settings that may change while a plan runs: they do not change what comes out."""
