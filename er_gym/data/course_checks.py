"""Checks of a trajectory's sequence of actions, independent of the environment."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from er_gym.data.remembered import searches_for_the_seen
from er_gym.data.trajectory import Trajectory
from er_gym.envs.actions import Action
from er_gym.rollout.records import KeyActionRecord
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import type_of_id

SHORTEST = "b"
"""The kind whose actions are the key actions and nothing else."""
MUST_SUCCEED = frozenset({"a", "b", "c", "anomaly", "explored", "corrected"})
"""Kinds that are taken into a collection only if the task was done."""


def course_problems(trajectory: Trajectory) -> Iterator[str]:
    """What is wrong with a trajectory's sequence of actions, one line for each problem.

    - A trajectory of a kind that must succeed does.
    - One of kind ``b`` consists of the task's key actions.
    - After a fault the same action is done later, or the episode succeeds.
    - No turn that is learnt from searches for what had been seen.
    """
    yield from searches_for_the_seen(trajectory)
    if trajectory.kind in MUST_SUCCEED and not trajectory.success:
        yield f"kind {trajectory.kind} must succeed, but it ended in {trajectory.end_reason!r}"
    if trajectory.kind == SHORTEST and not is_key_actions(trajectory):
        done = ", ".join(str(turn.action) for turn in trajectory.turns)
        yield f"kind {SHORTEST} must be the key actions and nothing else, but it is: {done}"
    if trajectory.success:
        return
    for index, turn in enumerate(trajectory.turns):
        later = trajectory.turns[index + 1 :]
        if turn.fault and not any(one.action == turn.action and one.success for one in later):
            yield f"turn {index}: the fault in {turn.action} is not recovered"


def is_key_actions(trajectory: Trajectory) -> bool:
    """Whether the actions are the task's key actions, in order, and nothing else."""
    return are_key_actions([turn.action for turn in trajectory.turns], trajectory.key_actions)


def are_key_actions(actions: Sequence[Action], key_actions: Sequence[KeyActionRecord]) -> bool:
    """Whether actions are the key actions, in order, and nothing else, ``end`` included."""
    keys = [*key_actions]
    if keys and keys[-1].verb != verbs.END:
        keys.append(KeyActionRecord(verb=verbs.END))
    return len(keys) == len(actions) and all(
        action.verb == key.verb
        and same_type(action.object_type, type_of_id(key.object_id) or key.object_type)
        for action, key in zip(actions, keys, strict=True)
    )
