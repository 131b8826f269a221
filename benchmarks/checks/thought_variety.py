"""How varied the grounded writer's thoughts are, and how long one takes.

    python -m benchmarks.checks.thought_variety --episodes 2000 --language en

It plays episodes with searches in vain, repeats and failed actions, writes their thoughts, and
prints the share of distinct sentences, the most frequent thoughts and sentences, the words a
thought, and the milliseconds a thought. Half of the episodes are an explorer's; in the others, the
expert's, actions go wrong and are tried again.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterator
from random import Random
from typing import Any

import click

from agents.expert.candidates import Candidate
from agents.expert.explorer import Strength
from agents.expert.kinds import draw_mode
from agents.expert.players import PlaySettings, Thinkers
from agents.expert.recipe import ANOMALY, EXPLORED
from agents.expert.thought_kinds import load_thought_kinds
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter
from agents.expert.writers.grounded import length_in_words, sentences
from agents.expert.writers.registry import WRITERS
from benchmarks.harness.measuring import timed
from er_gym import EmbodiedEnv
from er_gym.data.critic import Refusal, check
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


@click.command(help=f"\b\n{__doc__}")
@click.option("--episodes", default=300, show_default=True)
@click.option("--language", type=click.Choice(["en", "zh"]), default="en", show_default=True)
@click.option("--suite", default="train", show_default=True)
@click.option("--seed", default=0, show_default=True)
@click.option("--top", default=10, show_default=True, help="How many frequent ones to print.")
@click.option("--check", "checked", is_flag=True, help="Let the critic check each thought.")
def main(episodes: int, language: Language, suite: str, seed: int, top: int, checked: bool) -> None:
    writer, requests = WRITERS.get("grounded")(), list[ThoughtRequest]()
    said, thoughts = Counter[str](), Counter[str]()
    lengths: list[int] = []
    refused: list[tuple[Refusal, str, ThoughtRequest]] = []
    for number, (task, turns) in enumerate(played(episodes, seed, suite)):
        for request, records in written(writer, turns, task.instruction, language, number):
            requests.append(request)
            for record, limit in zip(records, request.limits, strict=True):
                thoughts[record.text] += 1
                said.update(sentences(record.text, language))
                lengths.append(length_in_words(record.text, language))
                if checked:
                    found = check(record.text, record.kind, request.knowledge, limit=limit)
                    refused += [(each, record.text, request) for each in found]
    seconds = timed(lambda: [writer.write(request) for request in requests]).clock
    total, cuts = sum(thoughts.values()), statistics.quantiles(lengths, n=20)
    print(f"episodes {episodes:,}, thoughts {total:,}, sentences {sum(said.values()):,}")
    print(f"distinct sentences {len(said) / sum(said.values()):.1%}")
    print(f"distinct thoughts {len(thoughts) / total:.1%}")
    print(f"words a thought: median {statistics.median(lengths)}, 5 % {cuts[0]}, 95 % {cuts[-1]}")
    print(f"milliseconds a thought {1000 * seconds / total:.2f}")
    for name, counts in (("thoughts", thoughts), ("sentences", said)):
        print(f"most frequent {name}:")
        for text, count in counts.most_common(top):
            print(f"  {count / counts.total():.2%} {text}")
    if checked:
        print(f"refused by the critic: {len(refused):,}")
        for code, count in Counter(each.code for each, _, _ in refused).most_common():
            print(f"  {code}: {count:,}")
        for refusal, text, request in refused[:top]:
            print(f"  {refusal.code}: {refusal.detail}\n    {request.knowledge.decision}: {text}")


if __name__ == "__main__":
    main()
