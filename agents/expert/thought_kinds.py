"""Which kinds of thoughts an agent has at a turn: a table of transitions, drawn from."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from random import Random
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from agents import configs
from er_gym.data.trajectory import ThoughtKind
from er_gym.tasks.task import Task
from er_gym.tasks.types import TRANSPORT

ACT = "act"
Check: TypeAlias = Literal["", "check", "think and check"]
"""How a task ends: at once, with a thought of verification, or with a thought and one."""
CHECKS: tuple[Check, ...] = ("", "check", "think and check")
Event: TypeAlias = Literal[
    "begin", "earned", "fruitless", "failed", "careless", "done", "check", "think and check"
]
"""What a turn's thoughts respond to."""
_MOST = 4
"""A turn has no more thoughts than this."""


def _sums_to_one(shares: dict[Any, float]) -> dict[Any, float]:
    if abs(sum(shares.values()) - 1.0) > 1e-6:
        raise ValueError(f"the shares {shares} sum to {sum(shares.values()):g}; let them sum to 1")
    return shares


Share: TypeAlias = Annotated[float, Field(ge=0, le=1)]
_Start: TypeAlias = Annotated[dict[ThoughtKind, Share], AfterValidator(_sums_to_one)]
_Next: TypeAlias = Annotated[
    dict[ThoughtKind | Literal["act"], Share], AfterValidator(_sums_to_one)
]
_Limits: TypeAlias = dict[ThoughtKind, Annotated[int, Field(ge=10)]]
_Draws: TypeAlias = tuple[Share, Share, Share]


class ThoughtKinds(BaseModel):
    """A table of transitions between thoughts; see ``configs/thoughts/transitions.yaml``.

    Attributes:
        kinds: after each kind of thought, the next kind, or ``act``.
        events: the first kind after each event.
        limits: the most words of a thought ``alone`` in its turn, and ``together`` with others.
        checks: by kind of task, the shares of :data:`CHECKS`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kinds: dict[ThoughtKind, _Next]
    events: dict[Event, _Start]
    limits: dict[Literal["alone", "together"], _Limits]
    checks: dict[Literal["single", "exposed to enclosed", "transfer", "ordered"], _Draws]

    def draw(self, event: Event, random: Random) -> tuple[ThoughtKind, ...]:
        """The kinds of a turn's thoughts, in order; at least one, and none twice."""
        drawn = [_draw(self.events[event], random)]
        while len(drawn) < _MOST:
            following = _draw(self.kinds[drawn[-1]], random)
            if following == ACT or following in drawn:
                break
            drawn.append(following)
        if event == "think and check":
            drawn = [drawn[0], "verification"]
        return tuple(drawn)

    def limits_of(self, kinds: tuple[ThoughtKind, ...]) -> tuple[int, ...]:
        """The most words of each of a turn's thoughts."""
        limits = self.limits["alone" if len(kinds) == 1 else "together"]
        return tuple(limits[kind] for kind in kinds)

    def draw_check(self, task: Task, random: Random) -> Check:
        """How a task ends."""
        shares = self.checks[_task_kind(task)]
        return random.choices(CHECKS, shares)[0]


def _draw(shares: Mapping[Any, float], random: Random) -> Any:
    return random.choices(list(shares), list(shares.values()))[0]


def _task_kind(task: Task) -> Literal["single", "exposed to enclosed", "transfer", "ordered"]:
    if task.type.ordered:
        return "ordered"
    if task.type.name == "pickup_and_put_in_closerep":
        return "exposed to enclosed"
    return "transfer" if task.type.group == TRANSPORT else "single"


@lru_cache(maxsize=8)
def load_thought_kinds(name: str = "transitions") -> ThoughtKinds:
    """Read a table of ``configs/thoughts`` by name, or any YAML file by path.

    Raises:
        ValueError: there is no such file, or it is not such a table.
    """
    file: Path = configs.file_of("thoughts", name, "table of transitions")
    return configs.load(ThoughtKinds, file, "table of transitions")
