"""Plays spoken episodes on two Ray nodes against a server that misbehaves, while a node is killed.

    python -m benchmarks.checks.cluster_talk [--episodes 200]

A fifth of the requests get no answer, an error, or a late one. The run stops first at a budget, and
the same command without it finishes. Then every episode must be there, none crashed; no request may
have been answered twice, which would have been paid twice; and what the first command spent must be
within its budget, but for requests that were under way.
"""

from __future__ import annotations

import json
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import click

from benchmarks.checks.cluster_kills import episodes_of
from benchmarks.checks.ray_nodes import RayNodes, ray_nodes
from benchmarks.harness.chat_server import (
    ChatServer,
    Exchange,
    Messages,
    counts,
    drawn,
    error,
    key_actions,
    replies,
)
from benchmarks.harness.processes import ER_GYM
from er_gym.rollout.run_directory import SPENDING
from er_gym.tasks import load_suite

_CONCURRENCY = 16
_TOKENS = 420
"""What the server says that each reply takes."""


def troubled(say: Callable[[Messages], str], seed: int) -> ChatServer:
    """Replies with these words, and misbehaves on a fifth of the requests."""
    tokens = counts(_TOKENS - 20, 20)
    faults = {
        "none": (80, replies(say, latency=0.05, keep=True, tokens=tokens)),
        "error": (5, error(500, Retry_After="0.2")),
        "hang-up": (5, Exchange.raw),
        "wait": (5, error(429, Retry_After="0.2")),
        "late": (5, replies(say, latency=1.05, keep=True, tokens=tokens)),
    }
    return ChatServer(drawn(faults, seed))


@click.command()
@click.option("--episodes", default=200, show_default=True)
@click.option("--seed", default=0, show_default=True)
def main(episodes: int, seed: int) -> None:
    """Play, kill, check."""
    every = {task.instruction: task for task in load_suite("er-1k").tasks}
    tasks = list(every.values())[:episodes]
    server = troubled(key_actions(tasks), seed)
    with tempfile.TemporaryDirectory() as scratch, ray_nodes(2) as nodes, server:
        out = Path(scratch) / "run"
        budget = 2 * _TOKENS * episodes
        ids = ",".join(task.id for task in tasks)
        play = ["bench", "--suite", "er-1k", "--task-ids", ids, "--agent", "openai:troubled"]
        play += ["--base-url", server.url, "--out", str(out), "--concurrency", str(_CONCURRENCY)]
        play += ["--workers", "2", "--executor", "ray", "--ray-address", nodes.address]
        first = _er_gym([*play, "--max-tokens", str(budget)], nodes, kill=True)
        spent = _tokens(out)
        second = _er_gym(play, nodes, kill=False)
        found = episodes_of(out)
        twice = server.repeated
        crashed = sum(bool(each["error"]) for each in found.values())
        print(
            f"exit codes {first} and {second}; {spent:,} of {budget:,} tokens spent at first; "
            f"{len(found)} of {episodes} episodes, {crashed} crashed; "
            f"{server.answered.total()} replies, {twice} requests answered twice, "
            f"{_tokens(out):,} tokens in the ledger; {dict(server.drawn)}"
        )
        most = budget + _CONCURRENCY * _TOKENS
        good = len(found) == episodes and not crashed and not twice and spent <= most
        good &= (first, second) == (3, 0) and _tokens(out) == _TOKENS * server.answered.total()
    raise SystemExit(0 if good else 1)


def _er_gym(arguments: list[str], nodes: RayNodes, kill: bool) -> int:
    with subprocess.Popen([*ER_GYM, *arguments], stdout=subprocess.DEVNULL) as process:
        while kill and process.poll() is None:
            time.sleep(1.0)
            if len(nodes.workers()) == 2:
                time.sleep(4.0)
                nodes.kill_node()
                nodes.add()
                kill = False
        return process.wait()


def _tokens(run: Path) -> int:
    """The tokens that the ledger of a run counts."""
    lines = (run / SPENDING).read_bytes().splitlines()
    return sum(each["prompt"] + each["completion"] for each in map(json.loads, lines))


if __name__ == "__main__":
    main()
