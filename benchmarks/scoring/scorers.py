"""Two readings of an episode: which of its task's key actions it did.

* ``paper`` counts as the evaluation program of Embodied-Reasoner (arXiv 2503.21696) does, quirks
  included, so that numbers stand beside the paper's table.
* ``corrected`` asks the judge of the environment (:mod:`er_gym.tasks.judge`) again, from the
  episode's record. Success and key actions done are what the environment said.

A scorer walks through an episode once and returns a :class:`KeyActionCounts`; the metrics
(:mod:`benchmarks.scoring.metrics`) are functions of the counts and the episode.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

from er_gym.rollout.judgement import judged
from er_gym.rollout.outcomes import succeeded
from er_gym.rollout.records import ERROR, EpisodeRecord, KeyActionRecord
from er_gym.tasks.task import KeyAction
from er_gym.tasks.verbs import END, INIT, MOVE_FORWARD, NAVIGATE, OBSERVE

JUDGED_BY_NAME = "single_search"
"""The task type whose ``end`` the paper scores only if the task's name was answered."""


@dataclass(frozen=True)
class KeyActionCounts:
    """What a walk through an episode counts.

    Attributes:
        expected: the key actions that score, as ``"verb Type"``, in the order of the task.
        scored: those that were done, in the order of the episode. ``end`` is left out where the
            task's name decides about it, which it does in the paper's reading only.
        points: how many scored, that ``end`` included.
        navigations_done: navigations of the task that were done; these key actions score nothing.
        navigated_to: the types that navigations named, failed ones too.
        steps: how many steps the episode took, ``init`` and ``end`` included.
        success: whether the task was done.
    """

    expected: tuple[str, ...]
    scored: tuple[str, ...]
    points: int
    navigations_done: int
    navigated_to: tuple[str, ...]
    steps: int
    success: bool


@dataclass(frozen=True)
class Scorer:
    """A reading of episodes.

    Attributes:
        name: as ``--scorer`` takes it.
        walk: through an episode, as if it had not crashed.
        version: changes when the same record is read in another way.
    """

    name: str
    walk: Callable[[EpisodeRecord], KeyActionCounts]
    version: int = 1

    def count(self, episode: EpisodeRecord) -> KeyActionCounts:
        """What was done; an episode that crashed is no success (:mod:`er_gym.rollout.outcomes`)."""
        counted = self.walk(episode)
        return replace(counted, success=succeeded(counted.success, episode.error))


# -- the paper's program ---------------------------------------------------------------------------

_PASSED_OVER = frozenset({INIT, OBSERVE, MOVE_FORWARD, NAVIGATE, ERROR})
_NOT_EXPECTED = (OBSERVE, MOVE_FORWARD, NAVIGATE)
_PUT = "put"
"""The paper spells ``put in`` so in its task files and takes replies of either spelling."""


def paper_label(key: KeyActionRecord) -> str:
    """A key action as the paper's program reads it from the task's file: ``put Bowl``."""
    verb = key.spelled or (_PUT if key.verb.startswith(_PUT) else key.verb)
    return f"{verb} {key.object_type}".strip()


def _label(verb: str, object_type: str) -> str:
    return f"{verb} {object_type}".rstrip()


def _paper(episode: EpisodeRecord) -> KeyActionCounts:
    """Count as the paper's program does.

    It reads types from the task's file alone: no step matches a key action whose type the file
    leaves empty. Every successful ``end`` scores, also in a task that does not ask for one; in a
    ``single_search`` it scores if the task's name contains the name of a type in reach, whatever
    the case ("spot" contains "Pot"), or if the last successful step was a key action. Replies that
    name no known action are steps.
    """
    keys = [paper_label(key) for key in episode.key_actions]
    expected = [key for key in keys if not any(verb in key for verb in _NOT_EXPECTED)]
    left, name = Counter(keys), episode.name.lower()
    scored: list[str] = []
    points = navigations_done = 0
    last = ""
    navigated_to: list[str] = []
    for step in episode.steps:
        if step.verb == NAVIGATE:
            navigated_to.append(step.object_type)
        if not step.success:
            continue
        verb, label = step.verb, _label(step.verb, step.object_type)
        if verb in _PASSED_OVER:
            if left[label] > 0:
                left[label] -= 1
                navigations_done += 1
        elif END in verb:
            if episode.task_type != JUDGED_BY_NAME:
                scored.append(verb)
                points += 1
            elif any(kind.lower() in name for kind in step.interactable):
                points += 1
            elif last in keys:
                points += 1
                break  # the program looks no further there either
        elif step.object_type:
            label = _label(_PUT if verb.startswith(_PUT) else verb, step.object_type)
            if left[label] > 0:
                left[label] -= 1
                scored.append(label)
                points += 1
        last = label
    return KeyActionCounts(
        tuple(expected),
        tuple(scored),
        points,
        navigations_done,
        tuple(navigated_to),
        len(episode.steps),
        success=bool(expected) and points >= len(expected),
    )


# -- corrected -------------------------------------------------------------------------------------


def _corrected(episode: EpisodeRecord) -> KeyActionCounts:
    """Count by the judge's verdict."""
    progress = judged(episode)
    named = progress.criteria.named

    def labels(keys: tuple[KeyAction, ...]) -> tuple[str, ...]:
        """The labels of the scoring key actions, with the object's id if only one object counts."""
        ids = (key.object_id if key.object_id in named else "" for key in keys)
        return tuple(
            f"{_label(key.verb, key.actual_type)} {object_id}".rstrip()
            for key, object_id in zip(keys, ids, strict=True)
            if key.scored
        )

    scored = labels(progress.done)
    return KeyActionCounts(
        expected=labels(progress.criteria.key_actions),
        scored=scored,
        points=len(scored),
        navigations_done=len(progress.done) - len(scored),
        navigated_to=tuple(step.object_type for step in episode.steps if step.verb == NAVIGATE),
        steps=episode.num_steps,
        success=progress.success,
    )


PAPER = Scorer("paper", _paper)
CORRECTED = Scorer("corrected", _corrected)
SCORERS = {scorer.name: scorer for scorer in (PAPER, CORRECTED)}
