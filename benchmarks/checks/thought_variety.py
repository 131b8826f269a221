"""How varied the grounded writer's thoughts are, and how long one takes.

It plays episodes with :mod:`benchmarks.checks.thought_episodes`, writes their thoughts, and prints
the share of distinct sentences, the most frequent thoughts and sentences, the words a thought, and
the milliseconds a thought::

    python -m benchmarks.checks.thought_variety --episodes 2000 --language en
"""

from __future__ import annotations

import statistics
from collections import Counter

import click

from agents.expert.writers.base import ThoughtRequest
from agents.expert.writers.grounded import sentences, words
from agents.expert.writers.registry import WRITERS
from benchmarks.checks.thought_episodes import played, written
from benchmarks.harness.measuring import timed
from er_gym.data.critic import Refusal, check
from er_gym.data.trajectory import Language


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
                lengths.append(words(record.text, language))
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
