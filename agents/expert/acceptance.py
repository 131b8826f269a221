"""Which trajectories are taken into a collection."""

from __future__ import annotations

from agents.expert.recipe import ANOMALY, CORRECTED, SEARCH
from er_gym.data.trajectory import Trajectory
from er_gym.rollout.records import KeyActionRecord
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import type_of_id


def rejection(trajectory: Trajectory, most_actions: int) -> str:
    """Why a trajectory is not taken, ``""`` if it is."""
    if not trajectory.success:
        return "no success"
    if trajectory.actions > most_actions:
        return "too long"
    if trajectory.kind == "b" and not is_key_actions(trajectory):
        return "more than the key actions"
    searches = trajectory.kind in ("a", "c") or trajectory.mode == SEARCH
    if searches and is_key_actions(trajectory):
        return "nothing was searched"
    odd = [turn for turn in trajectory.turns if turn.fault or turn.purpose == "repeat"]
    if trajectory.kind == ANOMALY and not odd:
        return "nothing went wrong"
    refused = any(not turn.success for turn in trajectory.turns)
    if refused and trajectory.kind not in (ANOMALY, CORRECTED):
        return "an action was refused"
    return ""


def is_key_actions(trajectory: Trajectory) -> bool:
    """Whether the actions are the task's key actions and nothing else."""
    keys = trajectory.key_actions
    if keys and keys[-1].verb != verbs.END:
        keys = [*keys, KeyActionRecord(verb=verbs.END)]
    return len(keys) == len(trajectory.turns) and all(
        turn.verb == key.verb
        and same_type(turn.object_type, type_of_id(key.object_id) or key.object_type)
        for turn, key in zip(trajectory.turns, keys, strict=True)
    )
