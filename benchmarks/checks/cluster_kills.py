"""Plays a suite on three Ray nodes of this machine while processes are killed, and compares.

    python -m benchmarks.checks.cluster_kills [--suite er-1k --agent searcher --kills 10]

Workers and raylets are killed by SIGKILL after random numbers of episodes; a killed node is
replaced. The run must have every episode once, none crashed, and each the same but for times as a
run in processes of this machine. With ``--head``, the head is killed in the end, and the same
command must finish the run on a new cluster. A run that ends before all are killed says so.
"""

from __future__ import annotations

import json
import math
import random
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import click

from benchmarks.checks.ray_nodes import RayNodes, ray_nodes
from benchmarks.harness.processes import ER_GYM, kill

_TIMES = ("seconds",)


@click.command()
@click.option("--suite", default="er-1k", show_default=True)
@click.option("--agent", default="searcher", show_default=True)
@click.option("--limit", type=int)
@click.option("--samples", default=1, show_default=True)
@click.option("--kills", default=10, show_default=True)
@click.option("--every", default=30, show_default=True, help="Episodes between kills, about.")
@click.option("--head", is_flag=True, help="Kill the head too, and finish on a new cluster.")
@click.option("--seed", default=0, show_default=True)
def main(
    suite: str,
    agent: str,
    limit: int | None,
    samples: int,
    kills: int,
    every: int,
    head: bool,
    seed: int,
) -> None:
    """Play, kill, compare."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        play = ["bench", "--suite", suite, "--agent", agent, "--samples", str(samples)]
        play += ["--limit", str(limit)] if limit else []
        start = time.perf_counter()
        _er_gym([*play, "--workers", "2", "--out", str(folder / "here")])
        here = time.perf_counter() - start
        start = time.perf_counter()
        with ray_nodes(3) as nodes:
            killed = play_and_kill(play, folder / "there", nodes, kills, every, head, seed)
        if head:
            with ray_nodes(2) as nodes:
                _er_gym(_on(play, folder / "there", nodes))
        there = time.perf_counter() - start
        print(
            f"local processes {here:.1f} s, three nodes with kills {there:.1f} s: {killed} "
            f"killed of {kills}"
        )
        _compare(folder / "here", folder / "there")


def _on(play: list[str], out: Path, nodes: RayNodes) -> list[str]:
    return [*play, "--executor", "ray", "--ray-address", nodes.address, "--out", str(out)]


def _er_gym(arguments: list[str]) -> None:
    subprocess.run([*ER_GYM, *arguments], check=True, stdout=subprocess.DEVNULL)


def play_and_kill(
    play: list[str],
    out: Path,
    nodes: RayNodes,
    kills: int,
    every: int,
    head: bool = False,
    seed: int = 0,
) -> dict[str, int]:
    """Run a command, and kill processes that work for it; returns how many of each kind.

    What is killed depends on how far the run is, not on the clock: a short run on a fast machine
    meets as many kills as one on a slow machine.

    Args:
        play: the command's arguments.
        out: its run directory.
        nodes: the cluster.
        kills: how many processes.
        every: episodes between two of them, about.
        head: whether the head is killed after these.
        seed: of what is killed and when.
    """
    draw = random.Random(seed)
    plan = [
        (math.ceil(draw.uniform(0.5, 1.5) * every), draw.choices(("workers", "nodes"), (7, 3))[0])
        for _ in range(kills)
    ]
    killed = {"workers": 0, "nodes": 0}
    command = [*ER_GYM, *_on(play, out, nodes)]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL) as process:
        for more, kind in plan:
            if not _played(process, out, more):
                break
            workers = nodes.workers()
            if not workers:
                continue
            if kind == "workers":
                kill(draw.choice(workers))
            else:
                nodes.kill_node()
                nodes.add()
            killed[kind] += 1
        if head and process.poll() is None:
            nodes.kill_head()
            print(f"head killed; the command ended with {process.wait()}")
            return killed
        if process.wait():
            raise SystemExit(f"the command ended with {process.returncode}")
        if head:
            print("the run ended before the head was killed; give a smaller --every")
    return killed


def _played(process: subprocess.Popen[bytes], out: Path, more: int) -> bool:
    """Wait until a run has some more episodes; False if its command ended before."""

    def episodes() -> int:
        return sum(1 for _ in (out / "episodes").glob("*.json"))

    enough = episodes() + more
    while episodes() < enough:
        if process.poll() is not None:
            return False
        time.sleep(0.02)
    return True


def _compare(here: Path, there: Path) -> None:
    """Compare two runs; exit code 1 if they differ."""
    ours, theirs = episodes_of(here), episodes_of(there)
    wrong = [name for name in sorted({*ours, *theirs}) if ours.get(name) != theirs.get(name)]
    crashed = [name for name, episode in theirs.items() if episode["error"]]
    print(
        f"{len(theirs)} of {len(ours)} episodes, {len(wrong)} different, {len(crashed)} crashed"
        + "".join(f"\n  {name}" for name in wrong[:10])
    )
    if wrong or crashed:
        raise SystemExit(1)


def episodes_of(run: Path) -> dict[str, Any]:
    """The episodes of a run by file name, without times."""
    found = {}
    for file in (run / "episodes").glob("*.json"):
        episode = json.loads(file.read_bytes())
        found[file.name] = {k: v for k, v in episode.items() if k not in _TIMES}
    return found


if __name__ == "__main__":
    main()
