"""Measures the decisions per second of agents that send pictures to a server.

    python -m benchmarks.perf.conversations [--concurrency 8 --workers 2 --latency 0.1]

The server runs in a process of its own on the same machine: it replies after the given time with
the tasks' key actions. So the figure depends only on this machine's cores and on that time; its
upper bound is concurrency / latency.
"""

from __future__ import annotations

import json
import multiprocessing
import tempfile
import threading
import time
from contextlib import closing, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import click

from benchmarks.vlm_run import VLMRun
from er_gym import __version__
from er_gym.rollout.events import EpisodeEnded, Event
from er_gym.rollout.executor import Parallelism
from er_gym.rollout.machines import THIS_MACHINE
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import Task, load_suite


class KeyActionReplies:
    """Replies with the next key action of a conversation's task."""

    def __init__(self, tasks: list[Task]) -> None:
        self._actions = {
            task.instruction: [f"{key.verb} {key.actual_type}".strip() for key in task.key_actions]
            for task in tasks
        }

    def __call__(self, messages: list[dict[str, Any]]) -> str:
        first = next(message["content"] for message in messages if message["role"] == "user")
        told = first if isinstance(first, str) else "".join(part.get("text", "") for part in first)
        actions = next(
            actions for instruction, actions in self._actions.items() if instruction in told
        )
        said = sum(message["role"] == "assistant" for message in messages)
        action = actions[min(said, len(actions) - 1)]
        return f"<Thinking>Next.</Thinking><DecisionMaking>{action}</DecisionMaking>"


class Server(ThreadingHTTPServer):
    """An OpenAI-compatible server that always replies, ``latency`` seconds after a request."""

    daemon_threads = True
    request_queue_size = 128

    def __init__(
        self,
        replies: KeyActionReplies,
        latency: float,
        handler: type[BaseHTTPRequestHandler] | None = None,
    ) -> None:
        super().__init__(("127.0.0.1", 0), handler or Handler)
        self.replies = replies
        self.latency = latency

    @property
    def url(self) -> str:
        """The address for ``--base-url``."""
        return f"http://127.0.0.1:{self.server_port}/v1"


class Handler(BaseHTTPRequestHandler):
    """Replies to a request."""

    server: Server
    protocol_version = "HTTP/1.1"  # connections are kept
    disable_nagle_algorithm = True

    def do_POST(self) -> None:
        arrived = time.monotonic()
        asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        said = self.server.replies(asked["messages"])
        body = json.dumps(
            {
                "id": "answer",
                "object": "chat.completion",
                "created": int(time.time()),
                "model": asked["model"],
                "choices": [
                    {
                        "index": 0,
                        "message": {"role": "assistant", "content": said},
                        "finish_reason": "stop",
                    }
                ],
                "usage": {"prompt_tokens": 100, "completion_tokens": 20, "total_tokens": 120},
            }
        ).encode()
        time.sleep(max(0.0, self.server.latency - (time.monotonic() - arrived)))
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)
        self.answered(asked)

    def answered(self, asked: dict[str, Any]) -> None:
        """Called after each answer."""

    def log_message(self, format: str, *args: object) -> None:
        """Log nothing."""


def serve(pipe: Connection, tasks: list[Task], latency: float) -> None:
    """The server's process."""
    server = Server(KeyActionReplies(tasks), latency)
    threading.Thread(target=server.serve_forever, daemon=True).start()
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
    vlm_run = VLMRun.of(
        "openai:answering-server",
        base_url=(ours.recv(),),
        overrides=[f"pictures.width={size}", f"pictures.height={size}"],
        concurrency=concurrency,
    )
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
                factory, run_directory, tasks, Parallelism(workers, machines=THIS_MACHINE), [note]
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
