"""A scripted agent that knows only the instruction: it parses it, searches and acts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, TypeAlias

from agents.scripted.searcher import instruction, search_priors
from agents.scripted.searcher.instruction import Goal, parse_instruction
from er_gym.envs.actions import Action
from er_gym.envs.info import LegalActions, names
from er_gym.rollout.agent import Decision
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

_RESERVE = 1
"""Steps reserved for "end"."""
_MOST_VISITS = 2
"""Fruitless visits to a receptacle type, per estimated receptacle in the room, before it counts as
searched."""

_ALL_OPENED = 2
"""After this many open containers of a type in a row, all of that type count as opened."""
Steps: TypeAlias = Generator[Action, None, bool]
"""Yields actions one at a time and returns whether it reached its goal."""


class _OutOfSteps(Exception):
    """Only the step for "end" is left."""


@dataclass
class StepView:
    """The parts of ``info`` that the searcher reads after a step."""

    sees: frozenset[str]
    holds: str
    navigable: tuple[str, ...]
    reach: frozenset[str]
    legal: Container[Action]
    done: bool
    left: int

    @staticmethod
    def of(info: Mapping[str, Any]) -> StepView:
        """Read ``info``."""
        return StepView(
            sees=frozenset(names(info["visible_mask"])),
            holds=info["held"],
            navigable=names(info["navigable_mask"]),
            reach=frozenset(names(info["interactable_mask"])),
            legal=LegalActions(info["action_mask"]),
            done=info["action_success"],
            left=info["max_steps"] - info["steps"] - _RESERVE,
        )

    def is_legal(self, verb: str, object_type: str) -> bool:
        """Whether an action is legal."""
        return Action(verb, object_type) in self.legal


@dataclass
class Memory:
    """What the searcher has seen and done so far in an episode.

    Attributes:
        at: the type that it last navigated to.
        visits: the number of visits by type.
        views_seen: by type, the distinct views on arrival.
        exhausted: types whose objects have all been seen.
        found: by object type, the receptacle types at which it was in view.
        opened: by container type that it opened and left open, the phase in which it did so.
        phase: counts fetches and put-downs.
        found_open: by type, how many containers in a row were already open.
    """

    at: str = ""
    visits: Counter[str] = field(default_factory=Counter)
    views_seen: dict[str, set[object]] = field(default_factory=dict)
    exhausted: set[str] = field(default_factory=set)
    found: dict[str, set[str]] = field(default_factory=dict)
    opened: dict[str, int] = field(default_factory=dict)
    phase: int = 0
    found_open: Counter[str] = field(default_factory=Counter)


class SearcherAgent:
    """Parses the instruction, searches likely places, and acts once an object is within reach.

    It uses the instruction and the ``info`` that every agent gets: the visible and the held
    objects, the navigable and the interactable types, and the legal actions. It does not read the
    task's key actions or goal, nor which object an action affected.

    Attributes:
        goals: what the instruction asks for, in order. Set it before the first :meth:`act` to leave
            out what is done.
    """

    obs_mode = "text"

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode: read the instruction."""
        self.goals: Sequence[Goal] = parse_instruction(task.instruction)
        self._memory = Memory()
        self._two_transfers = [goal.kind for goal in self.goals] == [
            instruction.PUT,
            instruction.PUT,
        ]
        self._thought = ""
        self._water_runs = False  # whether it has turned on the faucet
        self._tried_before: Counter[str] = Counter()  # in the search that comes next
        self._last: Action | None = None
        self._repeats = 0
        self._steps = self._episode()

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The next action of the plan, given the result of the last one."""
        self._take_result(info)
        try:
            action = next(self._steps)
        except (_OutOfSteps, StopIteration):
            action = Action(verbs.END)
        self._remember(action)
        return Decision(action, self._thought)

    def watch(self, action: Action, info: Mapping[str, Any]) -> None:
        """Take in a step of another agent; the first :meth:`act` continues from there.

        Args:
            action: what the other agent does next.
            info: the environment's answer before the action.
        """
        self._take_result(info)
        self._remember(action)

    # -- remembering -----------------------------------------------------------------------------

    def _take_result(self, info: Mapping[str, Any]) -> None:
        """Note what came of the last action."""
        self._view = StepView.of(info)
        self._update_memory()

    def _remember(self, action: Action) -> None:
        """Note what is done next."""
        self._repeats = self._repeats + 1 if action == self._last else 1
        self._last = action

    def _update_memory(self) -> None:
        view, memory, last = self._view, self._memory, self._last
        if last is not None and view.done:
            if last.verb == verbs.NAVIGATE:
                memory.visits[last.object_type] += 1
                memory.at = last.object_type
                sight = (view.sees, view.reach, view.holds)
                seen = memory.views_seen.setdefault(memory.at, set())
                if sight in seen and not search_priors.opens(memory.at):
                    memory.exhausted.add(memory.at)
                memory.views_seen[memory.at].add(sight)
            elif last.verb == verbs.OPEN:
                memory.opened[last.object_type] = memory.phase
            elif last.verb == verbs.CLOSE:
                memory.opened.pop(last.object_type, None)
        if memory.at:
            for name in view.sees:
                memory.found.setdefault(name, set()).add(memory.at)

    # -- the plan --------------------------------------------------------------------------------

    def _episode(self) -> Steps:
        goals = self.goals
        for number, goal in enumerate(goals):
            yield from _DO[goal.kind](self, goal, goals[number + 1 :])
        self._thought = "Everything is done." if goals else "I do not know what to do."
        return True

    def _step(self, verb: str, object_type: str = "", thought: str = "") -> Steps:
        """Take one action; returns whether it succeeded."""
        action = Action(verb, object_type)
        if self._view.left <= 0:
            raise _OutOfSteps
        if action == self._last and self._repeats >= 3:
            self._thought = "I should not do the same again."
            yield Action(verbs.MOVE_FORWARD if verb == verbs.OBSERVE else verbs.OBSERVE)
            if self._view.left <= 0:
                raise _OutOfSteps
        self._thought = thought or self._thought
        yield action
        return self._view.done

    def _is_legal(self, verb: str, name: str) -> bool:
        return self._view.is_legal(verb, name)

    # -- searching -------------------------------------------------------------------------------

    def _ready(self, thing: str, verb: str) -> bool:
        """Whether an object is within reach and, if a verb is given, the action is legal."""
        if not verb:
            return thing in self._view.reach
        return self._is_legal(verb, thing)

    def _reach(self, thing: str, verb: str = "", source: str = "") -> Steps:
        """Search until an object is within reach and the action is legal."""
        memory = self._memory
        tried, self._tried_before = self._tried_before, Counter()
        observed = bool(memory.visits) or bool(tried["observe"])
        if source:
            while (
                tried[source] < search_priors.usual_number(source)
                and source in self._view.navigable
            ):
                tried[source] += 1
                if (yield from self._look_into(source, thing, verb)):
                    return True
        while not self._ready(thing, verb):
            if not observed and thing not in self._view.navigable:
                observed = True
                yield from self._step(verbs.OBSERVE, thought=f"Where can the {thing} be?")
                continue
            if source and tried[source] == 0 and source in self._view.navigable:
                tried[source] += 1
                yield from self._look_into(source, thing, verb)
                continue
            target = self._best_place(thing, tried)
            if not target:
                if tried["observe"] < 2:
                    tried["observe"] += 1
                    yield from self._step(verbs.OBSERVE, thought="Is there anything new?")
                else:
                    tried.clear()
                    yield from self._step(verbs.MOVE_FORWARD, thought="I have looked everywhere.")
                continue
            tried[target] += 1
            yield from self._visit(target, thing, verb)
        return True

    def _visit(self, target: str, thing: str, verb: str) -> Steps:
        """Navigate to a place and look, also into closed containers there."""
        there = yield from self._step(
            verbs.NAVIGATE, target, f"The {thing} may be at the {target}."
        )
        if there and not self._ready(thing, verb):
            yield from self._look_inside(target, thing, verb)
        return there

    def _look_inside(self, target: str, thing: str, verb: str) -> Steps:
        """Look into closed containers at the place where it is."""
        shut = (
            [target]
            if search_priors.opens(target) and search_priors.has(thing, "pickupable")
            else []
        )
        if target == thing:  # it is not in view at its own place: a container hides it
            shut = [name for name in sorted(self._view.reach) if search_priors.opens(name)]
        if search_priors.opens(target):
            found_open = (
                0 if self._is_legal(verbs.OPEN, target) else self._memory.found_open[target] + 1
            )
            self._memory.found_open[target] = found_open
            if found_open >= _ALL_OPENED:
                self._memory.exhausted.add(target)
        for name in shut:
            if self._is_legal(verbs.OPEN, name) and not self._ready(thing, verb):
                yield from self._step(verbs.OPEN, name, f"Is the {thing} in the {name}?")
        return True

    def _look_into(self, source: str, thing: str, verb: str) -> Steps:
        """Navigate to the source and open it; an object in view before that is a different one."""
        if not search_priors.opens(source):
            yield from self._visit(source, thing, verb)
            return self._ready(thing, verb)
        yield from self._step(
            verbs.NAVIGATE, source, f"The instruction says that the {thing} is there."
        )
        before = thing in self._view.sees
        if self._is_legal(verbs.OPEN, source):
            yield from self._step(verbs.OPEN, source, f"Is the {thing} in the {source}?")
        return self._ready(thing, verb) and not before

    def _best_place(self, thing: str, tried: Mapping[str, int]) -> str:
        """The navigable type with the highest score, "" if none is left."""
        scored = [
            (self._promise(thing, name, tried), name)
            for name in self._view.navigable
            if self._repeats < 3 or self._last != Action(verbs.NAVIGATE, name)
        ]
        best, name = max(scored, default=(0.0, ""))
        return name if best > 0 else ""

    def _promise(self, thing: str, place: str, tried: Mapping[str, int]) -> float:
        if place == thing:
            return 10.0 / (1 + tried.get(place, 0)) if tried.get(place, 0) < 3 else 0.0
        if not search_priors.has(thing, "pickupable"):
            return self._vantage(thing, place, tried)
        if not search_priors.has(place, "receptacle"):
            return 0.001 if not tried.get(place) else 0.0
        times = tried.get(place, 0)
        number = search_priors.usual_number(place)
        if times >= number * _MOST_VISITS:
            return 0.0
        worth = search_priors.likelihood(thing, place)
        if place in self._memory.found.get(thing, ()) and times == 0:
            worth += 0.7
        elif place in self._memory.exhausted:
            worth *= 0.05
        elif max(self._memory.visits[place], times) >= number:
            worth *= 0.1
        return worth / (2.0 if search_priors.opens(place) else 1.0)

    def _vantage(self, thing: str, place: str, tried: Mapping[str, int]) -> float:
        """The score of a place as a viewpoint for an object that is not pickupable."""
        if tried.get(place, 0) >= search_priors.usual_number(place):
            return 0.0
        in_view = place in self._memory.found.get(thing, ())
        return (1.0 if in_view else 0.3) / (1 + self._memory.visits[place])

    # -- doing -----------------------------------------------------------------------------------

    def _find(self, goal: Goal, later: Iterable[Goal]) -> Steps:
        return (yield from self._reach(goal.object_type, source=goal.source))

    def _take(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        """Pick up an object and close its container."""
        thing = goal.object_type
        self._memory.phase += 1
        for _ in range(3):
            if self._view.holds == thing:
                return True
            yield from self._empty_hand()
            yield from self._reach(thing, verbs.PICKUP, goal.source)
            if self._two_transfers and self._opened_before(self._memory.at):
                yield from self._reopen(self._memory.at)
            if (yield from self._step(verbs.PICKUP, thing, f"There is the {thing}.")):
                yield from self._close_up()
        return self._view.holds == thing

    def _close_up(self) -> Steps:
        """Close the containers within reach that it opened."""
        for name in list(self._memory.opened):
            if self._is_legal(verbs.CLOSE, name):
                yield from self._step(verbs.CLOSE, name, f"I close the {name} again.")
        return True

    def _empty_hand(self) -> Steps:
        """Put the held object into a receptacle within reach."""
        if self._view.holds:
            for name in sorted(self._view.reach):
                if self._is_legal(verbs.PUT, name) and self._view.holds:
                    yield from self._step(verbs.PUT, name, "I need my hand free.")
        return True

    def _put(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        """Fetch an object and put it into its target."""
        yield from self._take(goal)
        yield from self._put_into(goal.object_type, goal.target)
        next_goal = next(iter(later), None)
        if next_goal is not None and not self._is_legal(verbs.PICKUP, next_goal.object_type):
            yield from self._close_up()
        return True

    def _put_into(self, thing: str, place: str) -> Steps:
        """Carry the held object to a receptacle, open it if needed, and put the object there."""
        self._memory.phase += 1
        for _ in range(4):
            if not self._view.holds:
                break
            yield from self._go_and_open(place)
            if self._is_legal(verbs.PUT, place):
                yield from self._step(verbs.PUT, place, f"The {thing} belongs here.")
        return not self._view.holds

    def _go_and_open(self, place: str) -> Steps:
        if place in self._view.navigable:
            yield from self._step(verbs.NAVIGATE, place, f"I go to the {place}.")
        if place not in self._view.reach:
            yield from self._reach(place)
        if self._two_transfers and self._opened_before(place):
            yield from self._reopen(place)
        if self._is_legal(verbs.OPEN, place) and not self._is_legal(verbs.PUT, place):
            yield from self._step(verbs.OPEN, place, f"The {place} is closed.")
        return True

    def _opened_before(self, place: str) -> bool:
        """Whether a container was left open in an earlier phase."""
        return self._memory.opened.get(place, self._memory.phase) < self._memory.phase

    def _reopen(self, place: str) -> Steps:
        """Close and open a container again: in a task of two transfers, opening counts only in
        order."""
        if self._is_legal(verbs.CLOSE, place):
            yield from self._step(verbs.CLOSE, place, f"The {place} was opened too early.")
            yield from self._step(verbs.OPEN, place)
        return True

    def _toggle(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        yield from self._reach(goal.object_type, verbs.TOGGLE, goal.source)
        yield from self._step(verbs.TOGGLE, goal.object_type, f"I switch the {goal.object_type}.")
        return True

    def _open(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        verb = verbs.OPEN if goal.kind == instruction.OPEN else verbs.CLOSE
        yield from self._reach(goal.object_type, verb, goal.source)
        return (yield from self._step(verb, goal.object_type))

    def _process(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        """Put an object into an appliance, run it, and pick the object up again."""
        thing = goal.object_type
        place, switch, times, closed = PROCESSES[goal.kind]
        yield from self._take(goal)
        yield from self._put_into(thing, place)
        if closed and self._is_legal(verbs.CLOSE, place):
            yield from self._step(verbs.CLOSE, place, "It runs only when it is closed.")
        if switch and not (switch == "Faucet" and self._water_runs):
            for _ in range(times):
                yield from self._reach(switch, verbs.TOGGLE)
                yield from self._step(verbs.TOGGLE, switch, f"I switch the {switch}.")
            self._water_runs = switch == "Faucet" or self._water_runs
        if self._is_legal(verbs.OPEN, place) and not self._is_legal(verbs.PICKUP, thing):
            yield from self._step(verbs.OPEN, place)
        yield from self._take(Goal(instruction.TAKE, thing))
        return True

    def _slice(self, goal: Goal, later: Iterable[Goal] = ()) -> Steps:
        knife = goal.target or "Knife"
        yield from self._take(Goal(instruction.TAKE, knife))
        yield from self._reach(goal.object_type, verbs.SLICE)
        yield from self._step(verbs.SLICE, goal.object_type)
        return True


class Process(NamedTuple):
    """What happens to an object in an appliance.

    Attributes:
        place: the receptacle type of the appliance.
        switch: the type that is switched, "" for none; and ``times``, how often.
        closed: whether it works only when closed.
    """

    place: str
    switch: str
    times: int
    closed: bool = False


PROCESSES = {
    instruction.WASH: Process("SinkBasin", "Faucet", 1),
    instruction.BREW: Process("CoffeeMachine", "CoffeeMachine", 1),
    instruction.HEAT: Process("Microwave", "Microwave", 2, closed=True),
    instruction.CHILL: Process("Fridge", "", 0, closed=True),
    instruction.TOAST: Process("Toaster", "Toaster", 1),
}
_DO = {
    instruction.FIND: SearcherAgent._find,
    instruction.TAKE: SearcherAgent._take,
    instruction.PUT: SearcherAgent._put,
    instruction.TOGGLE: SearcherAgent._toggle,
    instruction.OPEN: SearcherAgent._open,
    instruction.CLOSE: SearcherAgent._open,
    instruction.SLICE: SearcherAgent._slice,
    **dict.fromkeys(PROCESSES, SearcherAgent._process),
}
