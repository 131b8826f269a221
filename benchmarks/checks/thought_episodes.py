"""Episodes with searches in vain, repeats and failed actions, and their thoughts once more.

Half of them are an explorer's; in the others, the expert's, actions go wrong and are tried again.
"""

from __future__ import annotations

from collections.abc import Iterator
from random import Random
from typing import Any

from agents.expert.candidates import Candidate
from agents.expert.explorer import Strength
from agents.expert.kinds import draw_mode
from agents.expert.players import PlaySettings, Thinkers
from agents.expert.recipe import ANOMALY, EXPLORED
from agents.expert.thought_kinds import load_thought_kinds
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter
from agents.expert.writers.registry import WRITERS
from er_gym import EmbodiedEnv
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import Language, ThoughtRecord, Trajectory, Turn
from er_gym.rollout.play import play_episode
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

_FAULTS, _REPEATS = 0.1, 0.05
_EXPLORER = Strength(share=1.0, temperature=1.0)
_MOST_ACTIONS = 40
_LIMIT = 150
"""Words of a thought."""


def played(count: int, seed: int, suite: Any = "train") -> Iterator[tuple[Task, list[Turn]]]:
    """Episodes of tasks drawn from a suite."""
    random = Random(seed)
    settings = PlaySettings(load_thought_kinds(), None, "en")
    writer = Thinkers(WRITERS.get("grounded"))
    env = EmbodiedEnv(suite, obs_mode="objects", max_steps=_MOST_ACTIONS)
    try:
        for number, task in enumerate(random.sample(list(load_suite(suite).tasks), count)):
            anomalous = number % 2 == 0
            candidate = Candidate(
                task.id,
                "checks",
                "expert" if anomalous else "explorer",
                task,
                number,
                ANOMALY if anomalous else EXPLORED,
                draw_mode("b", random) if anomalous else "",
                strength=None if anomalous else _EXPLORER,
                repeats=_REPEATS,
            )
            env.set_faults(_FAULTS if anomalous else 0.0)
            agent = writer.make({task.id: candidate}, settings, _MOST_ACTIONS)(task, seed + number)
            episode = play_episode(env, agent, task, seed + number)
            (record,) = agent.attachments(episode, "turns").values()  # type: ignore[attr-defined]
            yield task, Trajectory.model_validate_json(record).turns
    finally:
        env.close()


def written(
    writer: ThoughtWriter, turns: list[Turn], instruction: str, language: Language, seed: int
) -> Iterator[tuple[ThoughtRequest, tuple[ThoughtRecord, ...]]]:
    """Write the thoughts of an episode anew, turn by turn; each turn knows those before it."""
    so_far: list[Turn] = []
    for index, turn in enumerate(turns):
        kinds = tuple(thought.kind for thought in turn.thoughts)
        bare = turn.model_copy(update={"thoughts": []})
        knowledge = knowledge_at([*so_far, bare], index, instruction=instruction, language=language)
        limits = (_LIMIT,) * len(kinds)
        request = ThoughtRequest(knowledge, kinds, limits, seed=seed * 1000 + index)
        thoughts = writer.write(request).thoughts
        so_far.append(turn.model_copy(update={"thoughts": list(thoughts)}))
        yield request, thoughts
