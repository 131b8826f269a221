"""Measures the decisions per second of agents that send pictures to a server.

    python -m benchmarks.perf.conversations [--concurrency 8 --workers 2 --latency 0.1]

The server runs in this process, and ``er-gym bench`` in others of the same machine: it replies
after the given time with the tasks' key actions. So the figure depends only on this machine's cores
and on that time; its upper bound is concurrency / latency.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import click

from benchmarks.harness.chat_server import ChatServer, counts, key_actions, replies
from benchmarks.harness.processes import ER_GYM
from er_gym.rollout.events import EpisodeEnded, RunBegun, read_events
from er_gym.tasks import load_suite


@click.command()
@click.option("--episodes", default=150, show_default=True)
@click.option("--concurrency", default=8, show_default=True)
@click.option("--workers", default=2, show_default=True)
@click.option("--latency", default=0.1, show_default=True, help="Seconds.")
@click.option("--size", default=300, show_default=True, help="Pixels, width and height.")
def main(episodes: int, concurrency: int, workers: int, latency: float, size: int) -> None:
    """Measure, and print."""
    tasks = list({task.instruction: task for task in load_suite("er-1k").tasks}.values())[:episodes]
    say, tokens = key_actions(tasks), counts(400, 20)
    speaks = replies(say, latency=latency, keep=True, tokens=tokens)
    with tempfile.TemporaryDirectory() as folder, ChatServer(speaks) as server:
        out = Path(folder) / "run"
        command = [
            *ER_GYM, "bench", "--suite", "er-1k", "--task-ids", ",".join(each.id for each in tasks),
            "--agent", "openai:answering-server", "--base-url", server.url,
            "--set", f"pictures.width={size}", "--set", f"pictures.height={size}",
            "--concurrency", str(concurrency), "--workers", str(workers), "--out", str(out),
        ]  # fmt: skip
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        events = list(read_events(out, ["run_begun", "episode_ended"]))
    (began,) = (event.time for event in events if isinstance(event, RunBegun))
    ended = [event for event in events if isinstance(event, EpisodeEnded)]
    decisions, whole = sum(event.steps for event in ended), ended[-1].time - began
    tenth = len(ended) // 10
    steady = sum(event.steps for event in ended[tenth:]) / (ended[-1].time - ended[tenth - 1].time)
    click.echo(
        f"{decisions} decisions in {len(ended)} episodes, {sum(bool(one.error) for one in ended)} "
        f"crashed, {whole:.1f} s: {decisions / whole:.1f} decisions/s with the start of the "
        f"processes, {steady:.1f} after the first tenth (at most {concurrency / latency:.0f})"
    )


if __name__ == "__main__":
    main()
