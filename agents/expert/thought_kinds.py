"""Draws the kinds of thoughts of a turn from a table of transitions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from functools import lru_cache
from random import Random
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, get_args

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from agents.configs import ConfigKind
from er_gym.data.trajectory import THOUGHT_KINDS, ThoughtKind
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
TaskKind: TypeAlias = Literal["single", "exposed to enclosed", "transfer", "ordered"]
"""A kind of task, as far as its end is concerned."""
_MOST = 4
"""A turn has no more thoughts than this."""


Row = TypeVar("Row", dict[Any, float], tuple[float, ...])


def _sums_to_one(row: Row) -> Row:
    shares = row.values() if isinstance(row, dict) else row
    if abs(sum(shares) - 1.0) > 1e-6:
        raise ValueError(f"the shares {row} sum to {sum(shares):g}; let them sum to 1")
    return row


def _has_all(names: Collection[str]) -> AfterValidator:
    """A table must have a row for each of these names."""

    def check(table: dict[Any, Any]) -> dict[Any, Any]:
        missing = [name for name in names if name not in table]
        if missing:
            raise ValueError(
                f"there are only {', '.join(table) or 'no rows'}; give {', '.join(missing)}, too"
            )
        return table

    return AfterValidator(check)


Share: TypeAlias = Annotated[float, Field(ge=0, le=1)]
_Start: TypeAlias = Annotated[dict[ThoughtKind, Share], AfterValidator(_sums_to_one)]
_Next: TypeAlias = Annotated[
    dict[ThoughtKind | Literal["act"], Share], AfterValidator(_sums_to_one)
]
_Limits: TypeAlias = Annotated[
    dict[ThoughtKind, Annotated[int, Field(ge=10)]], _has_all(THOUGHT_KINDS)
]
_Company: TypeAlias = Literal["alone", "together"]
_Draws: TypeAlias = Annotated[tuple[Share, Share, Share], AfterValidator(_sums_to_one)]


class ThoughtKinds(BaseModel):
    """A table of transitions between thoughts; see ``configs/thoughts/transitions.yaml``.

    Attributes:
        kinds: after each kind of thought, the next kind, or ``act``.
        events: the first kind after each event.
        limits: the most words of a thought ``alone`` in its turn, and ``together`` with others.
        checks: by kind of task, the shares of :data:`CHECKS`.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kinds: Annotated[dict[ThoughtKind, _Next], _has_all(THOUGHT_KINDS)]
    events: Annotated[dict[Event, _Start], _has_all(get_args(Event))]
    limits: Annotated[dict[_Company, _Limits], _has_all(get_args(_Company))]
    checks: Annotated[dict[TaskKind, _Draws], _has_all(get_args(TaskKind))]

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


def _task_kind(task: Task) -> TaskKind:
    if task.type.ordered:
        return "ordered"
    if task.type.name == "pickup_and_put_in_closerep":
        return "exposed to enclosed"
    return "transfer" if task.type.group == TRANSPORT else "single"


KINDS = ConfigKind(ThoughtKinds, "thoughts", "table of transitions")


@lru_cache(maxsize=8)
def load_thought_kinds(name: str = "transitions") -> ThoughtKinds:
    """Read a table by name or path; see :meth:`agents.configs.ConfigKind.load`."""
    return KINDS.load(name)
