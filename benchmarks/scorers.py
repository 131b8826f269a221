"""Two readings of an episode: which of its task's key actions it did.

* ``paper`` counts as the evaluation program of Embodied-Reasoner (arXiv 2503.21696) does, quirks
  included, so that numbers stand beside the paper's table.
* ``corrected`` mends what that program gets wrong. It takes a key action's type from its object id,
  where task files leave the type empty or name another, and counts Sink and SinkBasin as one. Where
  a task singles an object out, it asks for that object; and a task's goal must hold for a success.

A scorer walks through an episode once and returns a :class:`Tally`; the metrics
(:mod:`benchmarks.metrics`) are functions of the tally and the episode.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from benchmarks.episode import ERROR, EpisodeRecord, KeyActionRecord, StepRecord
from er_gym.tasks.task import type_of_id
from er_gym.tasks.verbs import END, INIT, MOVE_FORWARD, NAVIGATE, OBSERVE, UNSCORED, canonical_verb

JUDGED_BY_NAME = "single_search"
"""The one task type whose ``end`` scores only if the task's name was answered."""


@dataclass(frozen=True)
class Tally:
    """The walk through an episode.

    Attributes:
        expected: the key actions that score, as ``"verb Type"``, in the order of the task.
        scored: those that were done, in the order of the episode. ``end`` is left out where the
            task's name decides about it.
        points: how many scored, that ``end`` included.
        routes: key actions done besides, which score nothing: navigations that the task lists.
        gone_to: the types that navigations named, failed ones too.
        steps: how many steps the episode took, ``init`` and ``end`` included.
        goal_holds: whether the final state is as the task asks, where the scorer heeds that.
    """

    expected: tuple[str, ...]
    scored: tuple[str, ...]
    points: int
    routes: int
    gone_to: tuple[str, ...]
    steps: int
    goal_holds: bool = True


@dataclass(frozen=True)
class Scorer:
    """A reading of episodes.

    Attributes:
        name: as ``--scorer`` takes it.
        tally: the walk through an episode.
    """

    name: str
    tally: Callable[[EpisodeRecord], Tally]


# -- the paper's program ---------------------------------------------------------------------------

_PASSED_OVER = frozenset({INIT, OBSERVE, MOVE_FORWARD, NAVIGATE, ERROR})
_NOT_EXPECTED = (OBSERVE, MOVE_FORWARD, NAVIGATE)
_PUT = "put"
"""The paper spells ``put in`` so in its task files and takes replies of either spelling."""


def paper_label(key: KeyActionRecord) -> str:
    """A key action as the paper's program reads it from the task's file: ``put Bowl``."""
    verb = key.spelled or (_PUT if key.verb.startswith(_PUT) else key.verb)
    return f"{verb} {key.object_type}".strip()


def _paper(episode: EpisodeRecord) -> Tally:
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
    points = routes = 0
    last = ""
    gone_to: list[str] = []
    for step in episode.steps:
        if step.verb == NAVIGATE:
            gone_to.append(step.object_type)
        if not step.success:
            continue
        verb, label = step.verb, _label(step.verb, step.object_type)
        if verb in _PASSED_OVER:
            if left[label] > 0:
                left[label] -= 1
                routes += 1
        elif END in verb:
            if episode.task_type != JUDGED_BY_NAME:
                scored.append(verb)
                points += 1
            elif any(kind.lower() in name for kind in step.interactable):
                points += 1
            elif last in keys:
                points += 1
                break  # the program looks no further, at what follows there neither
        elif step.object_type:
            label = _label(_PUT if verb.startswith(_PUT) else verb, step.object_type)
            if left[label] > 0:
                left[label] -= 1
                scored.append(label)
                points += 1
        last = label
    return Tally(tuple(expected), tuple(scored), points, routes, tuple(gone_to), len(episode.steps))


# -- corrected -------------------------------------------------------------------------------------


def _one_sink(object_type: str) -> str:
    return "SinkBasin" if object_type == "Sink" else object_type


def _label(verb: str, object_type: str) -> str:
    return f"{verb} {object_type}".rstrip()


def _key_label(key: KeyActionRecord) -> str:
    object_type = _one_sink(type_of_id(key.object_id) or key.object_type)
    label = _label(canonical_verb(key.verb), object_type)
    return f"{label} {key.object_id}" if key.exact else label


def _search_answered(episode: EpisodeRecord, end: StepRecord, came_from_key_action: bool) -> bool:
    """Whether ``end`` answers a search: a type within reach is named by the task, or the last look
    or move was a key action (going to where the target is)."""
    return any(kind in episode.name for kind in end.interactable) or came_from_key_action


def _corrected(episode: EpisodeRecord) -> Tally:
    """Match an episode's steps with its task's key actions.

    Failed steps count for nothing. Each key action is matched at most once, in any order. ``end``
    scores where the task asks for it, save in a ``single_search`` that it does not answer. A step
    counts as the type that the agent named: the environment found the object by it, so unlike a
    file it cannot name another type.
    """
    keys = [(key, _key_label(key)) for key in episode.key_actions]
    expected = [label for key, label in keys if canonical_verb(key.verb) not in UNSCORED]
    open_keys = Counter(label for _, label in keys)
    every_key = frozenset(open_keys)
    scored: list[str] = []
    points = routes = 0
    previous = ""
    for step in episode.steps:
        if not step.success:
            continue
        label = _label(canonical_verb(step.verb), _one_sink(step.object_type))
        if step.verb == END:
            if label not in every_key:
                break  # a task that does not ask for it
            if episode.task_type != JUDGED_BY_NAME:
                scored.append(label)
                points += 1
            elif _search_answered(episode, step, previous in every_key):
                points += 1
            break
        if open_keys[f"{label} {step.object_id}"] > 0:
            label = f"{label} {step.object_id}"
        # An object is needed: a key action whose type the file left empty has a label without one,
        # and must stay unmatched.
        if step.object_type and open_keys[label] > 0:
            open_keys[label] -= 1
            if step.verb in UNSCORED:
                routes += 1
            else:
                scored.append(label)
                points += 1
        if step.verb in UNSCORED:
            previous = label
    return Tally(
        tuple(expected),
        tuple(scored),
        points,
        routes,
        tuple(step.object_type for step in episode.steps if step.verb == NAVIGATE),
        episode.num_steps,
        goal_holds=not episode.goal_unmet,
    )


PAPER = Scorer("paper", _paper)
CORRECTED = Scorer("corrected", _corrected)
SCORERS = {scorer.name: scorer for scorer in (PAPER, CORRECTED)}
