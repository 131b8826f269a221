"""Statistics of a collection, made in one pass; memory grows by some bytes a sentence."""

from __future__ import annotations

from array import array
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from typing import Any

import numpy as np

from er_gym.data.collection import Collection
from er_gym.data.paper_figures import ACTION, BEGIN
from er_gym.data.trajectory import THOUGHT_KINDS, ThoughtRecord, Trajectory
from er_gym.data.words import count_words, sentences

STATES = (BEGIN, *THOUGHT_KINDS, ACTION)
"""The rows of the transition matrix; its columns are these without the first."""


@dataclass
class PartStatistics:
    """What a part's trajectories are like.

    Attributes:
        trajectories, succeeded: counts.
        actions: number of actions to number of trajectories.
        pictures: number of pictures to number of trajectories.
        kinds: kind of trajectory to number of trajectories.
        faults: kind of fault to number of turns.
    """

    trajectories: int = 0
    succeeded: int = 0
    actions: Counter[int] = field(default_factory=Counter)
    pictures: Counter[int] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)
    faults: Counter[str] = field(default_factory=Counter)


@dataclass
class Statistics:
    """Statistics of a collection.

    Attributes:
        name: of the collection's suite.
        parts: by name, in alphabetical order.
        task_types, verbs, thoughts, writers: how many trajectories of each type of task, actions
            with each verb, thoughts of each kind and by each writer.
        words: kind of thought to words of all its thoughts.
        transitions: by state, then by the state that followed, how often
            (:data:`STATES`).
        languages: of trajectories.
        trained_turns: how many turns are to be learnt from, and ``turns``: of how many.
        refused: why the critic refused a model's attempts, with how often.
        replaced: how many thoughts the grounded writer wrote after the critic had refused a
            model's, or its own first ones.
        sentences, distinct_sentences: of thoughts.
        distinct_thoughts: how many different texts thoughts have.
        most_used: the text that most thoughts have, and ``most_used_count``: how many have it.
        requests, prompt_tokens, completion_tokens, usd: what models cost.
    """

    name: str = ""
    parts: dict[str, PartStatistics] = field(default_factory=dict)
    task_types: Counter[str] = field(default_factory=Counter)
    verbs: Counter[str] = field(default_factory=Counter)
    thoughts: Counter[str] = field(default_factory=Counter)
    words: Counter[str] = field(default_factory=Counter)
    transitions: dict[str, Counter[str]] = field(
        default_factory=lambda: {state: Counter() for state in STATES}
    )
    writers: Counter[str] = field(default_factory=Counter)
    languages: Counter[str] = field(default_factory=Counter)
    turns: int = 0
    trained_turns: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    replaced: int = 0
    sentences: int = 0
    distinct_sentences: int = 0
    distinct_thoughts: int = 0
    most_used: str = ""
    most_used_count: int = 0
    requests: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    usd: float = 0.0

    @property
    def trajectories(self) -> int:
        """How many there are."""
        return sum(part.trajectories for part in self.parts.values())

    @property
    def succeeded(self) -> int:
        """How many of them did their task."""
        return sum(part.succeeded for part in self.parts.values())

    @property
    def all_thoughts(self) -> int:
        """How many thoughts there are."""
        return self.thoughts.total()

    def transition_shares(self) -> dict[str, dict[str, float]]:
        """The transition matrix, in % of each row; rows of states that never occur are left out."""
        return {
            state: {after: 100 * number / row.total() for after, number in row.items()}
            for state, row in self.transitions.items()
            if row
        }

    def as_dict(self) -> dict[str, Any]:
        """The statistics as JSON can hold them."""
        return {
            "format": "er-gym/data-statistics/1",
            **_plain(vars(self)),
            "transition_shares": self.transition_shares(),
        }


def mean_and_most(counts: Mapping[int, int]) -> tuple[float, int]:
    """The mean and the largest of numbers, given how often each occurs; 0 where there is none."""
    total = sum(counts.values())
    if not total:
        return 0.0, 0
    return sum(number * times for number, times in counts.items()) / total, max(counts)


def statistics(collection: Collection) -> Statistics:
    """The statistics of a collection.

    Raises:
        CollectionError: the collection is damaged.
    """
    counter = _Counter(collection.manifest.suite)
    for trajectory in collection.trajectories():
        counter.add(trajectory)
    return counter.finished(lambda: collection.trajectories())


class _Counter:
    """Adds up trajectories. Of texts, only eight bytes each are kept."""

    def __init__(self, name: str) -> None:
        self._found = Statistics(name=name)
        self._parts: defaultdict[str, PartStatistics] = defaultdict(PartStatistics)
        self._texts, self._sentences = array("Q"), array("Q")

    def add(self, trajectory: Trajectory) -> None:
        found, part = self._found, self._parts[trajectory.part]
        part.trajectories += 1
        part.succeeded += trajectory.success
        part.actions[trajectory.actions] += 1
        part.pictures[trajectory.pictures] += 1
        part.kinds[trajectory.kind] += 1
        part.faults.update(turn.fault for turn in trajectory.turns if turn.fault)
        found.task_types[trajectory.task_type] += 1
        found.languages[trajectory.language] += 1
        found.verbs.update(turn.verb for turn in trajectory.turns)
        found.turns += trajectory.actions
        found.trained_turns += sum(turn.train for turn in trajectory.turns)
        found.requests += trajectory.cost.requests
        found.prompt_tokens += trajectory.cost.prompt_tokens
        found.completion_tokens += trajectory.cost.completion_tokens
        found.usd += trajectory.cost.usd
        for before, after in _transitions(trajectory):
            found.transitions[before][after] += 1
        for turn in trajectory.turns:
            for thought in turn.thoughts:
                self._add_thought(thought)

    def _add_thought(self, thought: ThoughtRecord) -> None:
        found = self._found
        found.thoughts[thought.kind] += 1
        found.words[thought.kind] += count_words(thought.text)
        found.writers[thought.writer] += 1
        found.refused.update(thought.refused)
        found.replaced += bool(thought.refused) and thought.writer == "grounded"
        self._texts.append(_digest(thought.text))
        self._sentences.extend(map(_digest, sentences(thought.text)))

    def finished(self, again: Any) -> Statistics:
        """The statistics; ``again`` gives the trajectories once more, to find one text."""
        found = self._found
        found.parts = {name: self._parts[name] for name in sorted(self._parts)}
        found.sentences = len(self._sentences)
        found.distinct_sentences = len(np.unique(np.array(self._sentences, np.uint64)))
        texts, counts = np.unique(np.array(self._texts, np.uint64), return_counts=True)
        found.distinct_thoughts = len(texts)
        if len(texts):
            most = int(texts[counts.argmax()])
            found.most_used_count = int(counts.max())
            found.most_used = next(text for text in _texts(again()) if _digest(text) == most)
        return found


def _transitions(trajectory: Trajectory) -> Iterator[tuple[str, str]]:
    """Each state with the one that follows it."""
    before = BEGIN
    for turn in trajectory.turns:
        for state in (*(thought.kind for thought in turn.thoughts), ACTION):
            yield before, state
            before = state


def _texts(trajectories: Iterable[Trajectory]) -> Iterator[str]:
    for trajectory in trajectories:
        for turn in trajectory.turns:
            yield from (thought.text for thought in turn.thoughts)


def _plain(value: Any) -> Any:
    """A value as JSON holds it. (``asdict`` cannot copy a Counter.)"""
    if isinstance(value, PartStatistics):
        return _plain(vars(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    return value


def _digest(text: str) -> int:
    """64 bits of a hash of a text: enough to tell ten million apart."""
    return int.from_bytes(blake2b(text.encode(), digest_size=8).digest(), "big")
