"""Plays spoken episodes on two Ray nodes against a server that misbehaves, while a node is killed.

    python -m benchmarks.checks.cluster_talk [--episodes 200]

A fifth of the requests get no answer, an error, or a late one. The run stops first at a budget, and
the same command without it finishes. Then every episode must be there, none crashed; no request may
have been answered twice, which would have been paid twice; and what the first command spent must be
within its budget, but for requests that were under way.
"""

from __future__ import annotations

import hashlib
import json
import random
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import click

from benchmarks.checks.cluster_kills import episodes_of
from benchmarks.checks.ray_nodes import RayNodes, ray_nodes
from benchmarks.perf.conversations import Handler, KeyActionReplies, Server
from er_gym.rollout.run_directory import SPENDING
from er_gym.tasks import load_suite

_CONCURRENCY = 16
_TOKENS = 120
"""What the server says that each reply takes."""


class TroubledServer(Server):
    """Replies with key actions, and misbehaves on a fifth of the requests."""

    def __init__(self, replies: KeyActionReplies, seed: int) -> None:
        super().__init__(replies, latency=0.05, handler=_TroubledHandler)
        self.draw = random.Random(seed)
        self.lock = threading.Lock()
        self.answered: Counter[str] = Counter()
        self.troubles: Counter[str] = Counter()


class _TroubledHandler(Handler):
    server: TroubledServer

    def do_POST(self) -> None:
        with self.server.lock:
            trouble = self.server.draw.choices(
                ("", "error", "hang-up", "wait", "late"), (80, 5, 5, 5, 5)
            )[0]
            self.server.troubles[trouble or "none"] += 1
        if trouble == "hang-up":
            self.close_connection = True
            self.rfile.read(int(self.headers["Content-Length"]))
            self.connection.close()
        elif trouble in ("error", "wait"):
            self.rfile.read(int(self.headers["Content-Length"]))
            self.send_response(500 if trouble == "error" else 429)
            self.send_header("Retry-After", "0.2")
            self.send_header("Content-Length", "0")
            self.end_headers()
        else:
            time.sleep(1.0 if trouble == "late" else 0.0)
            super().do_POST()

    def answered(self, asked: dict[str, Any]) -> None:
        told = hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest()
        with self.server.lock:
            self.server.answered[told] += 1


@click.command()
@click.option("--episodes", default=200, show_default=True)
@click.option("--seed", default=0, show_default=True)
def main(episodes: int, seed: int) -> None:
    """Play, kill, check."""
    every = {task.instruction: task for task in load_suite("er-1k").tasks}
    tasks = list(every.values())[:episodes]
    server = TroubledServer(KeyActionReplies(tasks), seed)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with tempfile.TemporaryDirectory() as scratch, ray_nodes(2) as nodes:
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
        twice = sum(count > 1 for count in server.answered.values())
        crashed = sum(bool(each["error"]) for each in found.values())
        print(
            f"exit codes {first} and {second}; {spent:,} of {budget:,} tokens spent at first; "
            f"{len(found)} of {episodes} episodes, {crashed} crashed; "
            f"{server.answered.total()} replies, {twice} requests answered twice, "
            f"{_tokens(out):,} tokens in the ledger; {dict(server.troubles)}"
        )
        most = budget + _CONCURRENCY * _TOKENS
        good = len(found) == episodes and not crashed and not twice and spent <= most
        good &= (first, second) == (3, 0) and _tokens(out) == _TOKENS * server.answered.total()
    raise SystemExit(0 if good else 1)


def _er_gym(arguments: list[str], nodes: RayNodes, kill: bool) -> int:
    command = [sys.executable, "-m", "benchmarks.cli", *arguments]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
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
