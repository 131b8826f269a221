"""The expert's course: it knows where objects are, and searches as if it did not."""

from __future__ import annotations

from random import Random

from agents.expert.course import Intent
from agents.expert.legs import Leg
from agents.expert.memory import Sighting
from agents.expert.places import (
    DrawnPlaces,
    PlaceChooser,
    draw_places,
    likely_places,
    plan_of,
)
from agents.expert.replayed_intents import replayed_intent
from agents.expert.task_course import GiveUp, Intents, TaskCourse
from agents.expert.thought_kinds import Check
from agents.scripted.searcher import search_priors
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction, Task

_MOST_WRONG = 3
"""After this many wrong places the expert looks around, then goes to the right one."""


class ExpertCourse(TaskCourse):
    """Follows a plan of places in which the right one has its index by the mode.

    As in the paper (arXiv 2503.21696): the first search follows the mode; each later search has as
    many places, the right one at a random index. Wrong places are plausible ones. If the right
    place is not known when its turn comes, the expert looks around. What it has seen it does not
    search for: it goes back there, also from a wrong place of its plan; if the task is about
    another object of the type, the course is given up. In kind ``b`` the course is the
    key actions and nothing else; where that is impossible it is given up.

    Args:
        task: the task.
        kind: ``a``, ``b`` or ``c``, for the later searches.
        mode: the first plan (:data:`agents.expert.kinds.MODES`).
        random: draws places.
        check: how the task ends.
        retries, repeats: see :class:`~agents.expert.task_course.TaskCourse`.
        strict: whether kind ``b`` is given up where it needs more than the key actions.
        places: chooses the wrong places.
    """

    def __init__(
        self,
        task: Task,
        kind: str,
        mode: str,
        random: Random,
        *,
        check: Check = "",
        retries: int = 0,
        repeats: float = 0.0,
        strict: bool | None = None,
        places: PlaceChooser = DrawnPlaces(),  # noqa: B008 (has no state)
    ) -> None:
        super().__init__(
            task,
            random,
            check=check,
            retries=retries,
            repeats=repeats,
            strict=kind == "b" if strict is None else strict,
        )
        self._kind, self._mode, self._places = kind, mode, places
        self._searches = 0

    def _find(self, leg: Leg) -> Intents:
        if leg.hidden:
            return (yield from self._search(leg))
        purpose = "carry" if self.view.held else "approach"
        for _ in range(2):
            place = self._known(leg.place)
            if place:
                yield from self._go(place, "carry" if purpose == "carry" else "approach")
                return True
            seen = self._memory.of(leg.place)
            if seen is not None and not self._strict:
                yield from self._go_back(seen, leg.place)
            else:
                yield from self._show_place(leg, ())
        raise GiveUp

    def _search(self, leg: Leg) -> Intents:
        """Go through the plan until the right place is reached, or the object was in view."""
        plan = self._plan(leg)
        wrong: list[str] = []
        for number, place in enumerate(plan):
            right = self._known(leg.place)
            if place == leg.place or self._memory.of(leg.thing) or len(wrong) >= _MOST_WRONG:
                break
            rest = tuple(right if each == leg.place and right else each for each in plan[number:])
            wrong.append(place)
            if place in self.view.navigable and (yield from self._visit(place, leg, rest)):
                if any(key.verb == verbs.OPEN for key in leg.actions):
                    raise GiveUp  # the task is about another object of the type
                break
        if not self._known(leg.place) and not self._memory.of(leg.thing):
            yield from self._show_place(leg, tuple(wrong))
        if seen := self._memory.of(leg.thing):
            return (yield from self._return_to(seen, leg))
        place = self._known(leg.place)
        if not place:
            raise GiveUp
        left = [each for each in plan if each not in wrong and each != leg.place]
        return (yield from self._go(place, "search", (place, *left)))

    def _return_to(self, seen: Sighting, leg: Leg) -> Intents:
        """Go to the place of an object that is or was in view."""
        if not seen.fits(leg.place):
            raise GiveUp  # the task is about another object of the type
        if not self._known(leg.place) and not self._strict:
            yield from self._go_back(seen, leg.place)
        place = self._known(leg.place)
        if not place:
            raise GiveUp
        return (yield from self._go(place, "approach"))

    def _plan(self, leg: Leg) -> list[str]:
        self._searches += 1
        seen = self._memory.of(leg.thing) is not None
        if self._kind == "b":
            mode = self._mode if self._searches == 1 else "1"
        elif self._searches == 1:
            if seen and "0" in self._mode:
                raise GiveUp  # nobody searches elsewhere for what is in view
            mode = self._mode
        elif seen:
            mode = "1"
        else:
            wrong = len(self._mode) - 1
            index = self._random.randint(0, wrong)
            mode = "0" * index + "1" + "0" * (wrong - index)
        plausible = likely_places(leg.thing, self.view.navigable, without=[leg.place])
        wrong_places = self._places.choose(leg.thing, plausible, mode.count("0"), self._random)
        return plan_of(mode, leg.place, wrong_places)

    def _show_place(self, leg: Leg, visited: tuple[str, ...]) -> Intents:
        """Look around, and once more from another place, until the right place is known or the
        object was in view."""
        if self._strict:
            raise GiveUp
        yield from self._look_around()
        if self._known(leg.place) or (leg.hidden and self._memory.of(leg.thing)):
            return True
        others = likely_places(leg.thing, self.view.navigable, without=[leg.place, *visited])
        for place in draw_places(others, 1, self._random, temperature=0.0):
            yield from self._visit(place, leg, (place,))
            if not self._known(leg.place) and not (leg.hidden and self._memory.of(leg.thing)):
                yield from self._look_around()
        return bool(self._known(leg.place))


class CorrectedCourse(ExpertCourse):
    """Repeats the beginning of a failed episode up to a wrong action, then does the task correctly.

    Args:
        task: the task.
        beginning: the actions, the wrong one last.
        random, check: see :class:`ExpertCourse`.
    """

    def __init__(
        self, task: Task, beginning: tuple[Action, ...], random: Random, check: Check = ""
    ) -> None:
        super().__init__(task, "corrected", "1", random, check=check, strict=False)
        self._beginning = beginning

    def _prelude(self) -> Intents:
        done = self.view.done
        for action in self._beginning:
            done = self.view.done
            yield self._replayed(action)
        if self.view.done > done:
            raise GiveUp  # nothing is wrong here: a fault made the action fail in the episode
        yield from self._free_hand()
        return True

    def _get_closer(self, key: KeyAction, leg: Leg, attempt: int) -> Intents:
        """Search the next place of the leg's type, if the agent may have come to another one.

        Other courses are given up then, since there are more candidates; failed episodes are few.
        """
        place = self._known(leg.place)
        lost = not (self._in_view(leg.thing) or same_type(self.view.held, leg.thing))
        if leg.hidden and place and lost:
            if self._memory.of(leg.thing):
                yield from self._go(place, "approach")
                return (yield from self._look_inside(place, leg))
            return (yield from self._visit(place, leg, (place,)))
        return (yield from super()._get_closer(key, leg, attempt))

    def _replayed(self, action: Action) -> Intent:
        """The intent that a replayed action seems to have."""
        intent = replayed_intent(action, self.view, self._legs, train=False)
        self._subgoal = intent.subgoal
        return intent

    def _free_hand(self) -> Intents:
        """Put down what the wrong action took."""
        wanted = {key.actual_type for key in self._task.key_actions if key.verb == verbs.PICKUP}
        held = self.view.held
        if not held or held in wanted:
            return True
        receptacles = (name for name in self.view.reach if search_priors.has(name, "receptacle"))
        for place in sorted(receptacles):
            down = Intent(Action(verbs.PUT, place), "put down", self._subgoal)
            if down.action in self.view.legal and (yield from self._do(down)):
                return True
        raise GiveUp
