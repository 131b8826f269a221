"""The settings of what guides a learner: teachers, a policy to start from, curricula.

They are parts of :class:`agents.rl.config.TrainConfig`. Imports neither torch nor environments.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from agents.configs import StrictSettings
from er_gym.tasks.types import canonical_names

Fraction = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[int, Field(gt=0)]
Rate = Annotated[float, Field(gt=0)]


class Practice(StrictSettings):
    """Rounds of DAgger after cloning: the policy plays, the searcher labels each step, and the
    policy is fitted to all data gathered so far (:mod:`agents.rl.practice`).

    Attributes:
        rounds: how many.
        steps: environment steps in a round.
        epochs: passes over all that has been gathered, after each round.
    """

    rounds: Positive = 4
    steps: Positive = 20_000
    epochs: Positive = 2


class WarmStart(StrictSettings):
    """Behaviour cloning before reinforcement learning.

    Attributes:
        teacher: the imitated agent: ``searcher``, or ``oracle``, which knows the key actions.
        episodes: the number of its episodes.
        successes_only: whether failed episodes are left out.
        epochs, batch_size, learning_rate: of the supervised training.
        final_learning_rate: the share of the learning rate that remains at its end.
        practice: rounds of DAgger that follow; None for none. They need ``env.subtasks``, and
            ``searcher`` as the teacher.
    """

    teacher: Literal["searcher", "oracle"] = "searcher"
    episodes: Positive = 2000
    successes_only: bool = True
    epochs: Positive = 5
    batch_size: Positive = 512
    learning_rate: Rate = 1e-3
    final_learning_rate: Fraction = 1.0
    practice: Practice | None = None


class Start(StrictSettings):
    """A trained policy from which reinforcement learning goes on (:mod:`agents.rl.anchored`).

    Attributes:
        policy: ``zoo:NAME``, a run directory, or a model file; it must observe what ``env`` says.
        value_steps: the number of environment steps at the beginning in which only the value
            function learns. The policy plays, and its weights stay as they are.
        value_learning_rate: the learning rate in these steps.
        kl: weight, in the loss, of the divergence KL(start || policy), nats per step, after
            ``value_steps``; 0 for none.
        final_kl: the share of this weight that remains in the end.
        kl_steps: the number of environment steps over which it falls in a line.
    """

    policy: str = Field(min_length=1)
    value_steps: int = Field(100_000, ge=0)
    value_learning_rate: Rate = 1e-3
    kl: float = Field(0.5, ge=0)
    final_kl: Fraction = 0.0
    kl_steps: Positive = 1_000_000

    def kl_weight(self, steps: int) -> float:
        """The weight of the divergence in the update after so many environment steps."""
        gone = min(1.0, max(0, steps - self.value_steps) / self.kl_steps)
        return self.kl * (1 - (1 - self.final_kl) * gone)


class Phase(StrictSettings):
    """A phase of a curriculum: the task types until ``until`` steps."""

    until: Positive
    types: tuple[str, ...] = Field(min_length=1)

    _types = field_validator("types")(canonical_names)


class NearGoal(StrictSettings):
    """A curriculum of the way that is left: episodes start within demonstrations of the searcher,
    first near the goal, then farther from it (:mod:`agents.rl.near_goal`).

    Each type of task has a position: the number of key actions that are left where its episodes
    start. It changes by one, by the success of episodes that started there.

    Attributes:
        types: the task types, or groups.
        share: of their episodes that start within a demonstration.
        first: the first position, and the nearest.
        further_at: the position moves away from the goal at this success or more.
        nearer_below: it moves towards the goal at less success than this.
        over: success is that of so many episodes at the position.
    """

    types: tuple[str, ...] = Field(("Composite",), min_length=1)
    share: Fraction = 0.5
    first: Positive = 2
    further_at: Fraction = 0.8
    nearer_below: Fraction = 0.5
    over: Positive = 50

    _types = field_validator("types")(canonical_names)

    @model_validator(mode="after")
    def _moves_one_way(self) -> NearGoal:
        if self.nearer_below > self.further_at:
            raise ValueError(
                f"nearer_below is {self.nearer_below:g}, more than further_at, "
                f"{self.further_at:g}: a success between them would move the start both ways"
            )
        return self

    def moved(self, position: int, results: tuple[bool, ...]) -> int:
        """The next position, after the results of the last episodes that started at this one."""
        if len(results) < self.over:
            return position
        success = sum(results) / len(results)
        if success >= self.further_at:
            return position + 1
        return max(self.first, position - 1) if success < self.nearer_below else position
