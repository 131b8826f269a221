"""Collects trajectories with a model that misbehaves as the writer, over real HTTP.

    python -m benchmarks.checks.expert_server [--suite SUITE] [--limit N] [--json FILE]

A scripted server answers 40 % of the requests with what is no thought of the robot
(:data:`benchmarks.checks.scripted_expert.SAYS`), and lets 15 % fail. First the command runs into a
budget; then the same command with a larger one goes on. No trajectory may be lost, no thought may
be one that the critic refuses, the budget must hold within the replies under way, and no answer may
be paid for twice. Prints the counts of refusals by code. The exit code is 1 if something is wrong.
"""

from __future__ import annotations

import json
import re
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from click.testing import CliRunner

from agents.expert.thought_kinds import load_thought_kinds
from benchmarks.checks.scripted_expert import scripted_expert
from benchmarks.cli.main import cli
from benchmarks.harness.chat_server import ChatServer
from benchmarks.harness.output import json_option, write_figures
from er_gym.data.collection import Collection
from er_gym.data.critic import check
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import ThoughtRecord, Trajectory
from er_gym.rollout.run_directory import SPENDING

CONCURRENCY = 8
BUDGET = 0.2
_STOPPED = 3
_ERROR_TEXT = re.compile(
    r"error|sorry|can't assist|cannot help|rate limit|\b(?:429|500)\b|<html>|</?[A-Z]",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Outcome:
    """What a collection with a misbehaving model came to.

    Attributes:
        problems: what is wrong, a line each.
        trajectories: how many are taken.
        thoughts: how many they have, by writer.
        refusals: how often the critic or the reading of a reply refused a thought, by code.
        requests: how many requests came to the server.
        paid: how many answers the ledger has, ``usd`` what they cost.
        seconds: the time that it took.
    """

    problems: tuple[str, ...]
    trajectories: int
    thoughts: dict[str, int]
    refusals: dict[str, int]
    requests: int
    paid: int
    usd: float
    seconds: float


def collect_with_faults(
    out: Path, limit: int, *more: str, seed: int = 0, bad: float = 0.4, budget: float = BUDGET
) -> Outcome:
    """Collect with the misbehaving server: first until a budget stops it, then to the end.

    Args:
        out: the directory of the collection.
        limit: how many trajectories.
        more: further options of the command.
        seed: of what the server does.
        bad: the share of its answers that are no thoughts of the robot.
        budget: the first budget, in US dollars.
    """
    began = time.monotonic()
    problems: list[str] = []
    with scripted_expert(bad=bad, failing=0.15, seed=seed) as server:
        command = [
            "collect", "--out", str(out), "--limit", str(limit), "--expert", "openai:scripted",
            "--base-url", server.url, "--concurrency", str(CONCURRENCY), "--places", "model",
            "--set", "prices.prompt=1", "--set", "prices.completion=10",
            "--set", "pictures.width=160", "--set", "pictures.height=96", *more,
        ]  # fmt: skip
        problems += _stops_at_the_budget(command, out, server, budget)
        paid_before = _ledger(out)
        result = CliRunner().invoke(cli, [*command, "--max-usd", "1000"], standalone_mode=False)
        if result.return_value != 0:
            problems.append(f"ended with {result.return_value}: {result.output[-1500:]}")
        again = server.count
        CliRunner().invoke(cli, [*command, "--max-usd", "1000"], standalone_mode=False)
        if server.count != again:
            problems.append(f"a collection that is done sent {server.count - again} requests")
        if server.repeated:
            problems.append(f"{server.repeated} requests were sent again after an answer")
        if server.accepted != len(_ledger(out)):
            problems.append(f"{server.accepted} answers, {len(_ledger(out))} in the ledger")
        requests = server.count
    ledger = _ledger(out)
    if ledger[: len(paid_before)] != paid_before:
        problems.append("the ledger was rewritten")
    taken = list(Collection.open(out).trajectories())
    if len(taken) != limit:
        problems.append(f"{limit - len(taken)} of {limit} trajectories are lost")
    thoughts = [thought for each in taken for turn in each.turns for thought in turn.thoughts]
    problems += [line for each in taken for line in wrong_thoughts(each)]
    return Outcome(
        problems=tuple(problems),
        trajectories=len(taken),
        thoughts=dict(Counter(each.writer for each in thoughts)),
        refusals=dict(Counter(code for each in thoughts for code in each.refused).most_common()),
        requests=requests,
        paid=len(ledger),
        usd=round(sum(entry["cost"] for entry in ledger), 4),
        seconds=round(time.monotonic() - began, 1),
    )


def _stops_at_the_budget(
    command: list[str], out: Path, server: ChatServer, budget: float
) -> Iterator[str]:
    limited = [*command, "--max-usd", str(budget)]
    result = CliRunner().invoke(cli, limited, standalone_mode=False)
    if result.return_value != _STOPPED or "the budget is spent" not in result.output:
        yield f"did not stop at the budget: {result.return_value}, {result.output[-1500:]}"
    costs = [entry["cost"] for entry in _ledger(out)]
    within = next((n for n in range(len(costs)) if sum(costs[:n]) >= budget), len(costs))
    if len(costs) > within + CONCURRENCY:
        yield f"{len(costs) - within} replies were paid for after the budget was spent"
    came = server.count
    result = CliRunner().invoke(cli, limited, standalone_mode=False)
    if result.return_value != _STOPPED or server.count != came:
        yield f"a spent budget let {server.count - came} more requests through"


def wrong_thoughts(trajectory: Trajectory) -> Iterator[str]:
    """What is wrong with the thoughts of a trajectory that a model wrote."""
    kinds = load_thought_kinds()
    for index, turn in enumerate(trajectory.turns):
        known = knowledge_at(
            trajectory.turns,
            index,
            instruction=trajectory.instruction,
            language=trajectory.language,
        )
        limits = kinds.limits_of(tuple(thought.kind for thought in turn.thoughts))
        for thought, limit in zip(turn.thoughts, limits, strict=True):
            place = f"{trajectory.id}, turn {index}, {thought.kind}"
            if _ERROR_TEXT.search(thought.text):
                yield f"{place} is an error's text: {thought.text[:200]}"
            if thought.writer == "grounded":
                continue
            refused = check(thought.text, thought.kind, known, limit=limit)
            if refused:
                yield f"{place} should not stand: {refused[0]}: {thought.text[:200]}"
        if not turn.thoughts:
            yield f"{trajectory.id}, turn {index} has no thought"
        yield from _wrong_writers(turn.thoughts, f"{trajectory.id}, turn {index}")


def _wrong_writers(thoughts: list[ThoughtRecord], place: str) -> Iterator[str]:
    for thought in thoughts:
        if thought.writer == "grounded" and not thought.refused:
            yield f"{place}: the grounded writer took the model's place without a reason"
        elif thought.writer not in ("grounded", "openai:scripted"):
            yield f"{place}: the writer is {thought.writer}"


def _ledger(out: Path) -> list[dict[str, Any]]:
    file = out / SPENDING
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


@click.command()
@click.option("--suite", default="mini", show_default=True)
@click.option("--limit", default=200, show_default=True)
@json_option
def main(suite: str, limit: int, file: Path | None) -> int:
    """Collect, and print what is wrong."""
    with tempfile.TemporaryDirectory() as directory:
        outcome = collect_with_faults(
            Path(directory) / "collection", limit, "--suite", suite, "--parts",
            "imitation,anomalies",
        )  # fmt: skip
    for problem in outcome.problems:
        click.echo(problem)
    figures = {name: value for name, value in vars(outcome).items() if name != "problems"}
    click.echo(json.dumps(figures, indent=1))
    write_figures(file, figures)
    return int(bool(outcome.problems))


if __name__ == "__main__":
    raise SystemExit(main(standalone_mode=False))
