"""Measures the decisions per second of agents that send pictures to a server.

    python -m benchmarks.perf.conversations [--concurrency 8 --workers 2 --latency 0.1]

The server runs in a process of its own on the same machine: it replies after the given time with
the tasks' key actions. So the figure depends only on this machine's cores and on that time; its
upper bound is concurrency / latency.
"""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from contextlib import closing, suppress
from multiprocessing.connection import Connection
from pathlib import Path

import click

from benchmarks.cli.executor import Workforce
from benchmarks.cli.vlm_options import VLMOptions
from benchmarks.cli.vlm_run import VLMRun
from benchmarks.harness.chat_server import ChatServer, key_actions, replies
from er_gym import __version__
from er_gym.rollout.events import EpisodeEnded, Event
from er_gym.rollout.machines import THIS_MACHINE
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import Task, load_suite


def serve(pipe: Connection, tasks: list[Task], latency: float) -> None:
    """The server's process."""
    with ChatServer(replies(key_actions(tasks), latency=latency, keep=True)) as server:
        pipe.send(server.url)
        with suppress(EOFError):
            pipe.recv()  # until the other end is closed


@click.command()
@click.option("--episodes", default=150, show_default=True)
@click.option("--concurrency", default=8, show_default=True)
@click.option("--workers", default=2, show_default=True)
@click.option("--latency", default=0.1, show_default=True, help="Seconds.")
@click.option("--size", default=300, show_default=True, help="Pixels, width and height.")
def main(episodes: int, concurrency: int, workers: int, latency: float, size: int) -> None:
    """Measure, and print."""
    suite = load_suite("er-1k")
    tasks = list({task.instruction: task for task in suite.tasks}.values())[:episodes]
    ours, theirs = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=serve, args=(theirs, tasks, latency), daemon=True
    )
    process.start()
    theirs.close()
    options = VLMOptions(
        base_url=(ours.recv(),),
        overrides=[f"pictures.width={size}", f"pictures.height={size}"],
        concurrency=concurrency,
    )
    vlm_run = VLMRun.of("openai:answering-server", options)
    env = {**suite.env, **vlm_run.env}
    ended: list[tuple[float, int]] = []
    with tempfile.TemporaryDirectory() as place:
        manifest = Manifest(
            suite=suite.name, suite_digest=suite.digest, suite_size=len(suite.tasks),
            agent=vlm_run.name, env=env, seed=0, er_gym=__version__,
        )  # fmt: skip
        run_directory = RunDirectory.create(Path(place), manifest)
        began = time.perf_counter()

        def note(event: Event) -> None:
            if isinstance(event, EpisodeEnded):
                ended.append((time.perf_counter(), event.steps))

        with closing(vlm_run.factory(run_directory.path)) as factory:
            outcome = vlm_run.play(
                factory, run_directory, tasks, Workforce(THIS_MACHINE, workers), [note]
            )
    ours.close()
    process.join(5)
    whole = ended[-1][0] - began
    decisions = sum(count for _, count in ended)
    tenth = len(ended) // 10
    steady = sum(count for _, count in ended[tenth:]) / (ended[-1][0] - ended[tenth - 1][0])
    click.echo(
        f"{decisions} decisions in {outcome.played} episodes, {len(outcome.crashed)} crashed, "
        f"{whole:.1f} s: {decisions / whole:.1f} decisions/s with the start of the processes, "
        f"{steady:.1f} after the first tenth (at most {concurrency / latency:.0f})"
    )


if __name__ == "__main__":
    main()
