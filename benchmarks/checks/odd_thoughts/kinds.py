"""The kinds of odd thoughts, each with the function that finds it in a turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from benchmarks.checks.odd_thoughts.moment import Moment
from benchmarks.checks.odd_thoughts.of_courses import (
    hard_to_find,
    other_destinations,
    unsure_of_success,
    usual_after_all,
    walks_on,
)
from benchmarks.checks.odd_thoughts.of_words import (
    half_sentences,
    same_reasons,
    strayed_pronouns,
)
from er_gym.data.remembered import check_remembered, searches_for_the_seen
from er_gym.data.thought import Thought
from er_gym.data.trajectory import Trajectory

GUESS = "a guess at what had been seen"
_LIMIT = 200
"""Words of a thought."""
KINDS: Mapping[str, Callable[[Moment], Iterator[str]]] = {
    "found it, but walks on": walks_on,
    "usual for a thing, though it holds another": usual_after_all,
    "hard to find, though in view at once": hard_to_find,
    "can't tell whether it worked": unsure_of_success,
    "half a sentence": half_sentences,
    "a pronoun for another thing": strayed_pronouns,
    "a destination that is not the task's": other_destinations,
    "look around explained in the same words": same_reasons,
}
"""All but the closers, which are counted over a collection."""


def oddities(trajectory: Trajectory) -> Iterator[tuple[str, list[str]]]:
    """Each kind, with what of it a trajectory has."""
    moments = [Moment(trajectory, index) for index in range(len(trajectory.turns))]
    searches = list(searches_for_the_seen(trajectory))
    yield GUESS, [*searches, *(one for at in moments if at.turn.train for one in guesses(at))]
    for kind, look in KINDS.items():
        yield kind, [f"turn {at.index}: {one}" for at in moments for one in look(at)]


def guesses(at: Moment) -> Iterator[str]:
    """The thoughts of a turn that guess at what had been seen."""
    for each in at.turn.thoughts:
        for _ in check_remembered(Thought(each.text, each.kind, _LIMIT, at.known)):
            yield f"turn {at.index}: {each.text}"
