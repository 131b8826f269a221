"""Why an episode failed: one kind for each, read from its record."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Final, Literal, TypeAlias, get_args

from benchmarks.scoring.scorers import CORRECTED
from er_gym.envs.info import REPEATED
from er_gym.rollout.records import ERROR, GAVE_UP, EpisodeRecord
from er_gym.tasks.verbs import END, INIT, NAVIGATE, OBSERVE

Failure: TypeAlias = Literal[
    "crashed", "gave up", "unusable replies", "wrong order", "wrong object", "never found",
    "repeated", "repeated action", "out of steps", "ended too early", "ended otherwise",
]  # fmt: skip
FAILURES: tuple[Failure, ...] = get_args(Failure)
"""The kinds, in the order in which they are looked for."""
_NO_ACTION: Final = "no known action"
_BY_END: Mapping[str, Failure] = {
    "end": "ended too early",
    "step limit": "out of steps",
    REPEATED: "repeated action",
}
"""What an episode is called in whose steps nothing else stands out, by the reason of its end. A
record that was made elsewhere may have another reason."""
_MOST_UNUSABLE = 0.25
"""More replies than this share that name no action explain a failure."""
_MOST_REPEATS = 0.5
"""The same for navigations to a type that was visited before."""


def failure_of(episode: EpisodeRecord) -> Failure | None:
    """Why an episode failed; None for a success by the corrected scorer.

    ``crashed``: it has no end. ``gave up``: the agent could not finish it, such as when the server
    refused the conversation. ``unusable replies``: many replies named no action, or they ended it.
    ``wrong order``: every key action was done, but not in the task's order. ``wrong object``:
    it did to another object what the task asks for. ``never found``: the first thing that the task
    wants was never within reach. ``repeated``: half of the navigations went where it had been.
    ``repeated action``: the same action again and again ended it. ``out of steps``: the limit ended
    it. ``ended too early``: it said ``end`` before all was done. ``ended otherwise``: for a reason
    that er-gym does not know.
    """
    if episode.error:
        return "crashed"
    if episode.end_reason == GAVE_UP:
        return "gave up"
    counted = CORRECTED.count(episode)
    if counted.success:
        return None
    steps = [step for step in episode.steps if step.verb != INIT]
    unusable = sum(step.verb == ERROR for step in steps)
    if episode.end_reason == _NO_ACTION or (steps and unusable / len(steps) > _MOST_UNUSABLE):
        return "unusable replies"
    did = [(step.verb, step.object_type) for step in steps if step.success and step.object_type]
    wanted = [
        (key.verb, key.object_type)
        for key in episode.key_actions
        if key.verb not in (END, NAVIGATE, OBSERVE)
    ]
    missing = Counter(counted.expected) - Counter(counted.scored)
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
    return _BY_END.get(episode.end_reason, "ended otherwise")


def _did_to_another(did: list[tuple[str, str]], wanted: list[tuple[str, str]]) -> bool:
    """Whether a verb of the task was done to a type that the task does not name at all."""
    types = {name for _, name in wanted}
    verbs = {verb for verb, _ in wanted}
    return any(verb in verbs and name not in types for verb, name in did if verb == "pickup")
