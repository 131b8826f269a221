"""How fast ``er-gym openenv`` answers many sessions at once, over sockets.

    python -m benchmarks.perf.openenv [--sessions 64] [--workers 2] [--pictures] [--steps 50]

Each session is a connection of OpenEnv's client, which plays legal actions one after another; all
play at once. The table has steps a second of wall time, and the processor seconds that the server
and the clients spend on a step, which do not depend on what else the machine does. It needs the
extra openenv.
"""

from __future__ import annotations

import asyncio
import random
import resource
import subprocess
import sys
import time

import click
from openenv.core import GenericEnvClient

from benchmarks.harness.output import ROOT

_TEXTS = ("observe", "move forward", "navigate to {}", "open {}", "pickup {}", "close {}")


@click.command()
@click.option("--sessions", type=click.IntRange(1, 1024), default=64, show_default=True)
@click.option("--workers", type=click.IntRange(1, 64), default=2, show_default=True)
@click.option("--steps", type=click.IntRange(1), default=50, show_default=True)
@click.option("--pictures", is_flag=True, help="Of 800×450, as PNG.")
def main(sessions: int, workers: int, steps: int, pictures: bool) -> None:
    """Start a server, play in all sessions at once, and print what it cost."""
    command = [sys.executable, "-m", "benchmarks.cli", "openenv", "--port", "0"]
    command += ["--suite", "er-1k", "--workers", str(workers), *(["--pictures"] * pictures)]
    server = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        address = server.stdout.readline().strip()
        took, played, slowest = asyncio.run(_play(address, sessions, steps))
    finally:
        server.terminate()
        server.wait()
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = resource.getrusage(resource.RUSAGE_SELF)
    click.echo(
        f"{sessions} sessions, {workers} processes: {played} steps in {took:.1f} s, "
        f"{played / took:.0f} a second; the slowest answer took {1000 * slowest:.0f} ms; "
        f"server {1000 * (spent.ru_utime + spent.ru_stime) / played:.2f} and clients "
        f"{1000 * (own.ru_utime + own.ru_stime) / played:.2f} ms of processor a step, "
        "with starting"
    )


async def _play(address: str, sessions: int, steps: int) -> tuple[float, int, float]:
    """Wall seconds of all steps together, their number, and the slowest one's seconds."""
    clients = [GenericEnvClient(address, connect_timeout_s=120) for _ in range(sessions)]
    await _until_it_listens(clients[0])
    begun = await asyncio.gather(*(each.reset(seed=n) for n, each in enumerate(clients)))
    tasks = {each.observation["task_id"] for each in begun}
    assert len(tasks) > sessions // 2, "sessions play the same task"
    started = time.perf_counter()
    slowest = await asyncio.gather(*(_play_one(each, n, steps) for n, each in enumerate(clients)))
    took = time.perf_counter() - started
    for each in clients:
        await each.close()
    return took, sessions * steps, max(slowest)


async def _until_it_listens(client: GenericEnvClient) -> None:
    for _ in range(600):
        try:
            await client.connect()
            return
        except ConnectionError:
            await asyncio.sleep(0.1)
    raise TimeoutError("the server does not answer")


async def _play_one(client: GenericEnvClient, seed: int, steps: int) -> float:
    """The seconds of the slowest step; a new episode begins where one ends."""
    dice, slowest = random.Random(seed), 0.0
    told = (await client.reset(seed=seed)).observation["text"]
    for _ in range(steps):
        types = told.partition("You can navigate to: ")[2].partition(".")[0].split(", ")
        text = dice.choice(_TEXTS).format(dice.choice(types))
        started = time.perf_counter()
        result = await client.step({"text": text})
        slowest = max(slowest, time.perf_counter() - started)
        told = result.observation["text"]
        if result.done:
            told = (await client.reset(seed=dice.randrange(10**6))).observation["text"]
    return slowest


if __name__ == "__main__":
    main()
