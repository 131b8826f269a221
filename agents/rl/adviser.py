"""Computes the searcher's next action after actions of another agent. Imports no torch.

The searcher's plan is a generator that expects its own actions. When another agent acts, such as
the policy that is to imitate it, the plan starts again from the current subtask, with the
searcher's memory of everything that was seen and done.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from agents.rl.subtask_memory import SubtaskMemory
from agents.rl.subtasks import FIND, Subtask
from agents.scripted.searcher import SearcherAgent, instruction
from agents.scripted.searcher.agent import Steps
from agents.scripted.searcher.instruction import Goal
from er_gym.envs.actions import Action
from er_gym.envs.info import action_of
from er_gym.tasks import verbs
from er_gym.tasks.task import Task
from er_gym.thor.objects import TYPES


class Adviser(SearcherAgent):
    """A searcher that gives its next action after each action of another agent.

    It knows what the searcher knows: the instruction, and the ``info`` that every agent gets.
    """

    def begin(self, task: Task, info: Mapping[str, Any], memory: SubtaskMemory) -> None:
        """Begin an episode; ``memory`` is the learner's, kept up to date by its observation."""
        self.reset(task, {}, info)
        self._subtask_memory = memory
        self._done: Action | None = None
        self._times = 0

    def advise(self, info: Mapping[str, Any]) -> Action:
        """The searcher's next action, given the last step's ``info``."""
        done = action_of(info)
        if done is not None:
            self._times = self._times + 1 if done == self._done else 1
            if done != self._last:
                self._last, self._repeats = done, self._times
                self._plan_again(done if info["action_success"] else None)
            self._done = done
        action = self.act({}, info).action
        assert isinstance(action, Action)
        return action

    def _plan_again(self, done: Action | None) -> None:
        tried = self._subtask_memory.tried
        self._tried_before = Counter({TYPES[kind]: int(tried[kind]) for kind in tried.nonzero()[0]})
        self._tried_before["observe"] = self._subtask_memory.observed
        self._memory.phase = self._subtask_memory.progress.number + 1
        self._steps = self._rest(done)

    def _rest(self, done: Action | None) -> Steps:
        """Do the remaining subtasks, beginning in the middle of the current one."""
        progress = self._subtask_memory.progress
        left = progress.subtasks[progress.number :]
        if left and done is not None and done.verb == verbs.NAVIGATE:
            yield from self._arrived(done.object_type, left[0])
        if done is not None and done.verb == verbs.PICKUP and self._subtask_memory.moved_on:
            yield from self._close_up()
        for number, subtask in enumerate(left, start=progress.number):
            yield from self._do(number, subtask, progress.subtasks[number + 1 : number + 2])
        self._thought = "Everything is done."
        return True

    def _arrived(self, place: str, subtask: Subtask) -> Steps:
        """Open the closed container to which the other agent has navigated, and look inside."""
        verb = "" if subtask.verb == FIND else subtask.verb
        if subtask.verb not in (verbs.PUT, verbs.CLOSE) and not self._ready(subtask.thing, verb):
            yield from self._look_inside(place, subtask.thing, verb)
        return True

    def _do(self, number: int, subtask: Subtask, following: tuple[Subtask, ...]) -> Steps:
        thing, verb = subtask.thing, subtask.verb
        self._memory.phase = number  # the searcher's own steps begin with adding 1
        if verb == FIND:
            return (yield from self._reach(thing, source=subtask.source))
        if verb == verbs.PICKUP:
            return (yield from self._take(Goal(instruction.TAKE, thing, source=subtask.source)))
        if verb == verbs.PUT:
            self._memory.phase += 1
            yield from self._put_here(subtask.place)
            self._memory.phase -= 1
            if self._view.holds == thing:
                yield from self._put_into(thing, subtask.place)
            for after in following:
                if not self._is_legal(verbs.PICKUP, after.thing):
                    yield from self._close_up()
            return True
        if verb == verbs.CLOSE and self._is_legal(verbs.CLOSE, thing):
            return (yield from self._step(verbs.CLOSE, thing))
        yield from self._reach(thing, verb, subtask.source)
        return (yield from self._step(verb, thing))

    def _put_here(self, place: str) -> Steps:
        """Put what is held into a receptacle within reach."""
        if self._two_transfers and self._opened_before(place):
            yield from self._reopen(place)
        if self._is_legal(verbs.OPEN, place) and not self._is_legal(verbs.PUT, place):
            yield from self._step(verbs.OPEN, place)
        if self._is_legal(verbs.PUT, place):
            yield from self._step(verbs.PUT, place)
        return True
