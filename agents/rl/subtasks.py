"""An instruction as a list of subtasks, and which of them is current.

The subtasks come from the words of the instruction alone, read as the searcher reads them
(:mod:`agents.scripted.searcher.instruction`). Which one is at hand follows from what the agent did
itself. Neither looks at the key actions or the goal of the task.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

from agents.scripted.searcher import instruction as words
from agents.scripted.searcher.agent import PROCESSES
from agents.scripted.searcher.instruction import Goal, parse_instruction
from er_gym.envs.actions import Action
from er_gym.tasks import verbs

FIND = words.FIND
SUBTASK_VERBS = (
    *(FIND, verbs.PICKUP, verbs.PUT, verbs.TOGGLE),
    *(verbs.OPEN, verbs.CLOSE, verbs.SLICE),
)
"""What a subtask can ask for: to be within reach of an object, or one successful action."""


@dataclass(frozen=True)
class Subtask:
    """One step of an instruction.

    Attributes:
        verb: one of :data:`SUBTASK_VERBS`.
        thing: the object type that it is about; for ``put in`` the type that is carried.
        place: for ``put in`` the receptacle type; for ``slice`` the type of knife; otherwise "".
        source: the receptacle type that the instruction says holds the thing; "" if it names none.
    """

    verb: str
    thing: str
    place: str = ""
    source: str = ""

    @property
    def tool(self) -> str:
        """The type that must be in the hand, "" for none."""
        return {verbs.PUT: self.thing, verbs.SLICE: self.place}.get(self.verb, "")

    @property
    def action(self) -> Action | None:
        """The action that completes it; None for ``find``."""
        if self.verb == FIND:
            return None
        return Action(self.verb, self.place if self.verb == verbs.PUT else self.thing)


@lru_cache(maxsize=4096)
def subtasks(instruction: str) -> tuple[Subtask, ...]:
    """The subtasks of an instruction in the order in which they are to be done; () if it has none.

    "Heat the Egg" is: pick it up, put it into the Microwave, close that, switch it on and off, and
    pick the Egg up again.
    """
    found: list[Subtask] = []
    for goal in parse_instruction(instruction):
        water_runs = Subtask(verbs.TOGGLE, "Faucet") in found
        for step in _steps(goal):
            if not (water_runs and goal.kind == words.WASH and step.thing == "Faucet"):
                found.append(step)
    return tuple(found)


def _steps(goal: Goal) -> Iterator[Subtask]:
    thing, source = goal.object_type, goal.source
    if goal.kind == words.FIND:
        yield Subtask(FIND, thing, source=source)
    elif goal.kind in _SINGLE:
        yield Subtask(_SINGLE[goal.kind], thing, source=source)
    elif goal.kind == words.SLICE:
        knife = goal.target or "Knife"
        yield Subtask(verbs.PICKUP, knife)
        yield Subtask(verbs.SLICE, thing, knife)
    else:
        process = PROCESSES.get(goal.kind)
        place = process.place if process else goal.target
        yield Subtask(verbs.PICKUP, thing, source=source)
        yield Subtask(verbs.PUT, thing, place)
        if process is not None:
            if process.closed:
                yield Subtask(verbs.CLOSE, place)
            for _ in range(process.times):
                yield Subtask(verbs.TOGGLE, process.switch)
            yield Subtask(verbs.PICKUP, thing)


_SINGLE = {
    words.TAKE: verbs.PICKUP,
    words.TOGGLE: verbs.TOGGLE,
    words.OPEN: verbs.OPEN,
    words.CLOSE: verbs.CLOSE,
}
"""The kinds of goals that one action fulfils."""


class Progress:
    """Which subtask of an instruction is current.

    Attributes:
        subtasks: all of them, in order.
        number: the index of the one at hand; ``len(subtasks)`` once all are done.
        furthest: the highest that it has been: one before it has been done, and may come again.
    """

    def __init__(self, instruction: str) -> None:
        self.subtasks = subtasks(instruction)
        self.number = self.furthest = 0

    def at(self, ahead: int = 0) -> Subtask | None:
        """The subtask at hand, or one of those after it; None beyond the last."""
        place = self.number + ahead
        return self.subtasks[place] if place < len(self.subtasks) else None

    def update(self, done: Action | None, held: str, reach: frozenset[str]) -> bool:
        """Take in the result of a step; returns whether another subtask is at hand now.

        Args:
            done: the action of the step if it succeeded, otherwise None.
            held: the type in the hand, "" for none.
            reach: the types within reach.
        """
        before = self.number
        now = self.at()
        if now is not None and done is not None and done == now.action:
            self.number += 1
        while (now := self.at()) is not None and _fulfilled(now, held, reach):
            self.number += 1
        self.furthest = max(self.furthest, self.number)
        while (now := self.at()) is not None and now.tool and held != now.tool:
            earlier = self._pickup_before(now.tool)
            if earlier is None:
                break
            self.number = earlier
        return self.number != before

    def _pickup_before(self, thing: str) -> int | None:
        """The last subtask before this one that picks a type up."""
        for place in range(self.number - 1, -1, -1):
            if self.subtasks[place].verb == verbs.PICKUP and self.subtasks[place].thing == thing:
                return place
        return None


def _fulfilled(subtask: Subtask, held: str, reach: frozenset[str]) -> bool:
    """Whether a subtask needs no action."""
    if subtask.verb == FIND:
        return subtask.thing in reach
    return subtask.verb == verbs.PICKUP and held == subtask.thing
