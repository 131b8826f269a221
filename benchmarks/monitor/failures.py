"""Why an episode failed: one kind for each, read from its record."""

from __future__ import annotations

from collections import Counter
from typing import Literal, TypeAlias

from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.tasks.verbs import END, INIT, NAVIGATE, OBSERVE

Failure: TypeAlias = Literal[
    "crashed", "unusable replies", "wrong order", "wrong object", "never found", "repeated",
    "out of steps", "ended too early",
]  # fmt: skip
FAILURES: tuple[Failure, ...] = (
    "crashed", "unusable replies", "wrong order", "wrong object", "never found", "repeated",
    "out of steps", "ended too early",
)  # fmt: skip
"""The kinds, in the order in which they are looked for."""
_MOST_UNUSABLE = 0.25
"""More replies than this share that name no action explain a failure."""
_MOST_REPEATS = 0.5
"""The same for navigations to a type that was visited before."""


def failure_of(episode: EpisodeRecord) -> Failure | None:
    """Why an episode failed; None for a success by the corrected scorer.

    ``crashed``: it has no end. ``unusable replies``: many replies named no action, or they ended
    it. ``wrong order``: every key action was done, but not in the task's order. ``wrong object``:
    it did to another object what the task asks for. ``never found``: the first thing that the task
    wants was never within reach. ``repeated``: half of the navigations went where it had been.
    ``out of steps``: the limit ended it. ``ended too early``: it said ``end`` before all was done.
    """
    if episode.error:
        return "crashed"
    tally = CORRECTED.tally(episode)
    if tally.success:
        return None
    steps = [step for step in episode.steps if step.verb != INIT]
    unusable = sum(step.verb == ERROR for step in steps)
    if steps and unusable / len(steps) > _MOST_UNUSABLE:
        return "unusable replies"
    did = [(step.verb, step.object_type) for step in steps if step.success and step.object_type]
    wanted = [
        (key.verb, key.object_type)
        for key in episode.key_actions
        if key.verb not in (END, NAVIGATE, OBSERVE)
    ]
    missing = Counter(tally.expected) - Counter(tally.scored)
    missing.pop(END, None)
    if wanted and not Counter(wanted) - Counter(did):
        return "wrong order" if len(wanted) > 1 else "wrong object"
    if _did_to_another(did, wanted):
        return "wrong object"
    if wanted and not any(wanted[0][1] in step.interactable for step in episode.steps):
        return "never found"
    went = [step.object_type for step in steps if step.verb == NAVIGATE]
    if went and 1 - len(set(went)) / len(went) >= _MOST_REPEATS:
        return "repeated"
    return "ended too early" if steps and steps[-1].verb == END else "out of steps"


def _did_to_another(did: list[tuple[str, str]], wanted: list[tuple[str, str]]) -> bool:
    """Whether a verb of the task was done to a type that the task does not name at all."""
    types = {name for _, name in wanted}
    verbs = {verb for verb, _ in wanted}
    return any(verb in verbs and name not in types for verb, name in did if verb == "pickup")
