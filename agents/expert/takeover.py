"""A searcher takes over a failed episode: it knows what was seen, and does the rest."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from agents.expert.course import Intent
from agents.expert.legs import legs_of
from agents.expert.memory import Remembering
from agents.expert.replayed_intents import replayed_intent
from agents.scripted.searcher import SearcherAgent, SpotterAgent, instruction
from agents.scripted.searcher.instruction import Goal
from er_gym.envs.actions import Action
from er_gym.rollout.agent import Decision
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction, Task

SEARCHERS = {"searcher": SearcherAgent, "spotter": SpotterAgent}
"""The searchers that can take over, by name."""


class SearcherCourse(Remembering):
    """Repeats the beginning of a failed episode, then lets the searcher finish the task.

    The searcher knows the instruction and what the episode has seen, as the failed agent did; it is
    also given the goals that are done. :class:`~agents.expert.course.Course`.

    Args:
        task: the task.
        beginning: the actions, the wrong one last.
        searcher: takes over.
    """

    def __init__(self, task: Task, beginning: Sequence[Action], searcher: SearcherAgent) -> None:
        super().__init__()
        self._task, self._beginning, self._searcher = task, beginning, searcher
        self._legs = legs_of(task)

    def intents(self) -> Iterator[Intent]:
        """See :class:`~agents.expert.course.Course`."""
        searcher = self._searcher
        searcher.reset(self._task, {}, self.view.info)
        for action in self._beginning:
            searcher.watch(action, self.view.info)
            yield replayed_intent(action, self.view, self._legs, train=False)
        searcher.goals = goals_left(searcher.goals, self._done())
        refused: Action | None = None
        while True:
            decided = searcher.act({}, self.view.info)
            assert isinstance(decided, Decision)
            assert isinstance(decided.action, Action)
            again = decided.action == refused
            yield replayed_intent(
                decided.action,
                self.view,
                self._legs,
                train=True,
                again=again,
                memory=self._memory,
            )
            refused = None if self.view.success else decided.action

    def _done(self) -> Iterator[KeyAction]:
        """The key actions that are done. Of equal ones, any."""
        left = Counter(self.view.left)
        for key in self._task.key_actions:
            if left[key]:
                left[key] -= 1
            else:
                yield key


def goals_left(goals: Iterable[Goal], done: Iterable[KeyAction]) -> list[Goal]:
    """The goals of an instruction that are still to be reached.

    A goal is reached by its last key action; each key action reaches one goal, the first that it
    fits. Finding an object, and what an appliance does, count as open until the episode ends.
    """
    spent = [(key.verb, key.actual_type) for key in done]
    left = []
    for goal in goals:
        verb = _LAST_ACTION.get(goal.kind, "")
        name = goal.target if goal.kind == instruction.PUT else goal.object_type
        found = next((one for one in spent if one[0] == verb and same_type(one[1], name)), None)
        if found is None:
            left.append(goal)
        else:
            spent.remove(found)
    return left


_LAST_ACTION = {
    instruction.TAKE: verbs.PICKUP,
    instruction.PUT: verbs.PUT,
    instruction.TOGGLE: verbs.TOGGLE,
    instruction.SLICE: verbs.SLICE,
    instruction.OPEN: verbs.OPEN,
    instruction.CLOSE: verbs.CLOSE,
}
