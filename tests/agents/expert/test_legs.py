"""The legs of a task: what is left of each, and what an agent is after."""

from __future__ import annotations

from collections import Counter
from functools import cache

from agents.expert.legs import at_hand, keys_left, legs_of
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

AIDS = (verbs.OPEN, verbs.CLOSE)


@cache
def tasks() -> list[Task]:
    """The tasks of ``train``, a few of each kind."""
    seen: Counter[tuple[str, ...]] = Counter()
    found = []
    for task in load_suite("train").tasks:
        kind = tuple(key.verb for key in task.key_actions)
        seen[kind] += 1
        if seen[kind] <= 5:
            found.append(task)
    return found


def test_whoever_does_the_key_actions_is_after_each_in_its_turn() -> None:
    checked: Counter[str] = Counter()
    for task in tasks():
        legs, carried = legs_of(task), ""
        for index, key in enumerate(task.key_actions):
            if key.verb in (verbs.NAVIGATE, verbs.END, *AIDS):
                continue
            here = at_hand(legs, task.key_actions[index:])
            assert here is not None
            leg, subgoal = here
            assert key in leg.actions
            about = carried if key.verb == verbs.PUT else key.actual_type
            assert (subgoal.verb, subgoal.thing) == (key.verb, about), task.id
            if key.verb == verbs.PICKUP:
                carried = key.actual_type
                puts = [one for one in task.key_actions[index:] if one.verb == verbs.PUT]
                assert subgoal.place == (puts[0].actual_type if puts else ""), task.id
            checked[key.verb] += 1
    assert min(checked[verb] for verb in (verbs.PICKUP, verbs.PUT, verbs.TOGGLE)) > 50


def test_equal_key_actions_are_done_one_after_the_other() -> None:
    """A drawer that is opened for two things is not left to be opened for the first again."""
    twice = 0
    for task in tasks():
        keys, legs = task.key_actions, legs_of(task)
        for index, key in enumerate(keys):
            if key.verb == verbs.OPEN and key in keys[:index]:
                twice += 1
                left = keys_left(legs, keys[index:])
                assert sum(map(len, left)) == sum(
                    one.verb not in (verbs.NAVIGATE, verbs.END) for one in keys[index:]
                )
                first = next(number for number, leg in enumerate(legs) if key in leg.actions)
                assert legs[first].actions.index(key) not in left[first], task.id
    assert twice


def test_whoever_forgot_to_close_is_after_the_next_thing() -> None:
    closed = [
        task
        for task in tasks()
        if any(key.verb == verbs.CLOSE for leg in legs_of(task)[:-1] for key in leg.actions)
    ]
    assert closed
    for task in closed:
        legs = legs_of(task)
        number = next(
            index for index, leg in enumerate(legs)
            if any(key.verb == verbs.CLOSE for key in leg.actions)
        )  # fmt: skip
        close = next(key for key in legs[number].actions if key.verb == verbs.CLOSE)
        later = [key for leg in legs[number + 1 :] for key in leg.actions]
        here = at_hand(legs, [close, *later])
        assert here is not None
        assert here[0] in legs[number + 1 :], task.id


def test_when_all_is_done_an_agent_is_at_the_last_leg() -> None:
    for task in tasks():
        legs = legs_of(task)
        assert at_hand(legs, ()) == (legs[-1], legs[-1].subgoals[-1])
    assert at_hand((), ()) is None
