"""Who can take over a failed episode: a searcher, or a policy of the zoo; or, to check the records
of one, what such an agent did.

The episode itself is :mod:`agents.expert.takeover`'s.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol, cast

from agents import make_agent
from agents.expert.course import View
from agents.scripted.searcher import SearcherAgent, SpotterAgent, instruction
from agents.scripted.searcher.instruction import Goal
from agents.zoo.index import PREFIX, find_model
from er_gym.envs.actions import Action
from er_gym.rollout.agent import Agent, CanBeOverruled, Decision
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction, Task

SEARCHERS = {"searcher": SearcherAgent, "spotter": SpotterAgent}
"""The searchers that can take over, by name."""
EXPERT = "expert"
CORRECTORS = (EXPERT, *SEARCHERS)
"""Who can take over a failed episode, besides ``zoo:NAME``, a policy of the zoo. The ``expert``
(:class:`~agents.expert.expert.CorrectedCourse`) knows where things are; the others know the
instruction and what the episode has seen."""


class Successor(Protocol):
    """Who takes over an episode. It knows the instruction, and what the episode has seen, as the
    agent that failed did."""

    @property
    def observes(self) -> str:
        """The observations that it needs, as a mode; ``""`` for none."""

    def begin(self, task: Task, view: View) -> None:
        """An episode begins."""

    def watch(self, action: Action, view: View) -> None:
        """The agent that failed did an action; ``view`` is what it saw before."""

    def take_over(self, done: Iterable[KeyAction]) -> None:
        """The next action is the successor's; those key actions are done."""

    def act(self, view: View) -> Action:
        """What the successor does."""


@dataclass(frozen=True)
class SearcherTakesOver:
    """A searcher as :class:`Successor`; it is also given the goals that are done."""

    searcher: SearcherAgent

    @property
    def observes(self) -> str:
        """See :class:`Successor`."""
        return ""

    def begin(self, task: Task, view: View) -> None:
        """See :class:`Successor`."""
        self.searcher.reset(task, {}, view.info)

    def watch(self, action: Action, view: View) -> None:
        """See :class:`Successor`."""
        self.searcher.watch(action, view.info)

    def take_over(self, done: Iterable[KeyAction]) -> None:
        """See :class:`Successor`."""
        self.searcher.goals = goals_left(self.searcher.goals, done)

    def act(self, view: View) -> Action:
        """See :class:`Successor`."""
        return _action(self.searcher.act({}, view.info))


class Follower(Agent, CanBeOverruled, Protocol):
    """An agent that can follow an episode in which another one acts."""


@dataclass(frozen=True)
class PolicyTakesOver:
    """A policy, such as :class:`agents.rl.agent.RLAgent`, as :class:`Successor`."""

    policy: Follower

    @property
    def observes(self) -> str:
        """See :class:`Successor`."""
        return self.policy.obs_mode

    def begin(self, task: Task, view: View) -> None:
        """See :class:`Successor`."""
        self.policy.reset(task, view.obs, view.info)

    def watch(self, action: Action, view: View) -> None:
        """See :class:`Successor`."""
        self.policy.overruled(action, view.obs, view.info)

    def take_over(self, done: Iterable[KeyAction]) -> None:
        """See :class:`Successor`; the policy has followed the episode."""

    def act(self, view: View) -> Action:
        """See :class:`Successor`."""
        return _action(self.policy.act(view.obs, view.info))


class RecordedTakesOver:
    """Does what a successor did once; :class:`Successor`.

    Args:
        actions: the successor's.
    """

    observes = ""

    def __init__(self, actions: Iterable[Action]) -> None:
        self._left = iter(actions)

    def begin(self, task: Task, view: View) -> None:
        """See :class:`Successor`."""

    def watch(self, action: Action, view: View) -> None:
        """See :class:`Successor`."""

    def take_over(self, done: Iterable[KeyAction]) -> None:
        """See :class:`Successor`."""

    def act(self, view: View) -> Action:
        """See :class:`Successor`."""
        return next(self._left)


def _action(decided: object) -> Action:
    assert isinstance(decided, Decision)
    assert isinstance(decided.action, Action)
    return decided.action


def successor(name: str) -> Successor:
    """Who takes over: a searcher, or a policy of the zoo.

    Args:
        name: one of :data:`SEARCHERS`, or ``zoo:NAME``.

    Raises:
        ValueError: the zoo has no such policy, or it cannot be loaded.
    """
    if name in SEARCHERS:
        return SearcherTakesOver(SEARCHERS[name]())
    policy = make_agent(check_corrector(name))
    assert isinstance(policy, CanBeOverruled)
    return PolicyTakesOver(cast(Follower, policy))


def check_corrector(name: str) -> str:
    """The name of who takes over, if there is one.

    Raises:
        ValueError: there is none; the message says who there is.
    """
    if name.startswith(PREFIX):
        kind = find_model(name.removeprefix(PREFIX)).card.kind
        if kind != "policy":
            raise ValueError(f"{name} does not take over: it is a {kind}, not a policy")
    elif name not in CORRECTORS:
        raise ValueError(
            f"{name!r:.80} cannot take over an episode; give {', '.join(CORRECTORS)}, or "
            f"{PREFIX}NAME, a policy of the zoo"
        )
    return name


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
