"""Measures how fast the player answers the official client, and what limits the speed.

    python -m benchmarks.perf.player_speed [--seconds 2] [--rounds 3] [--width 300] [--height 300]
                                        [--server fifo|wsgi]

Each sort of step is timed through the official client. The client reports the processor time of its
own work; the player's is read from the kernel. The rest is waiting: pipes, the scheduler, other
programs.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console
from rich.table import Table

_TICK = os.sysconf("SC_CLK_TCK")
_GOAL = 400.0
STEPS: dict[str, list[dict[str, Any]]] = {
    "Pass, with a frame": [{"action": "Pass"}],
    "Pass, whole messages": [{"action": "Pass"}],
    "GetReachablePositions, with a frame": [{"action": "GetReachablePositions"}],
    "RotateRight 10°, with a frame": [{"action": "RotateRight", "degrees": 10}],
    "MoveRight and left, no frame": [
        {"action": "MoveRight", "renderImage": False},
        {"action": "MoveLeft", "renderImage": False},
    ],
}
"""What is timed; the first is the one with a goal, the second has ``fastActionEmit`` off."""


@dataclass(frozen=True)
class Rate:
    """The cost of one sort of step.

    Attributes:
        per_second: steps, over the whole of a round.
        client, player: processor time of a step, milliseconds.
    """

    per_second: float
    client: float
    player: float

    @property
    def waiting(self) -> float:
        """Milliseconds of a step in which neither worked."""
        return max(0.0, 1000 / self.per_second - self.client - self.player)

    @property
    def bound(self) -> str:
        """The process that takes most of the time."""
        shares = {"the client": self.client, "the player": self.player, "waiting": self.waiting}
        most = max(shares, key=shares.__getitem__)
        return f"{most}, {100 * shares[most] * self.per_second / 1000:.0f} %"


def processor_time(pid: int) -> float:
    """Seconds that a process has worked so far, in steps of a tick."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / _TICK


def measure(step: Callable[[], object], pid: int, seconds: float) -> Rate:
    """Repeat a step for so long."""
    step()
    count, start = 0, time.perf_counter()
    client, player = time.process_time(), processor_time(pid)
    while (took := time.perf_counter() - start) < seconds:
        step()
        count += 1
    return Rate(
        count / took,
        1000 * (time.process_time() - client) / count,
        1000 * (processor_time(pid) - player) / count,
    )


@click.command()
@click.option("--seconds", default=2.0, show_default=True, type=click.FloatRange(0.01))
@click.option("--rounds", default=3, show_default=True, type=click.IntRange(1))
@click.option("--width", default=300, show_default=True, type=click.IntRange(1))
@click.option("--height", default=300, show_default=True, type=click.IntRange(1))
@click.option(
    "--server",
    default="fifo",
    show_default=True,
    type=click.Choice(["fifo", "wsgi"]),
    help="The client's server class; WSGI knows whole messages only.",
)
def main(seconds: float, rounds: int, width: int, height: int, server: str) -> None:
    """Measure, and print one table: of each sort of step the median round."""
    from ai2thor.controller import Controller
    from ai2thor.fifo_server import FifoServer
    from ai2thor.wsgi_server import WsgiServer

    import er_gym

    start = time.perf_counter()
    controller = Controller(
        local_executable_path=er_gym.thor_executable(),
        x_display=":0",
        server_class={"fifo": FifoServer, "wsgi": WsgiServer}[server],
        scene="FloorPlan1",
        width=width,
        height=height,
    )
    ready = time.perf_counter() - start
    pid = controller.unity_pid
    found: dict[str, list[Rate]] = {name: [] for name in STEPS}
    for _ in range(rounds):
        for name, requests in STEPS.items():
            controller.reset(fastActionEmit="whole" not in name)

            def step(requests: list[dict[str, Any]] = requests) -> None:
                for request in requests:
                    controller.step(**request, raise_for_failure=True)

            rate = measure(step, pid, seconds)
            each = len(requests)
            found[name].append(Rate(rate.per_second * each, rate.client / each, rate.player / each))
    controller.stop()
    medians = {name: _median(rates) for name, rates in found.items()}
    _show(medians, ready, server, f"{width}×{height}")


def _median(rates: list[Rate]) -> Rate:
    middle = statistics.median_low(rate.per_second for rate in rates)
    return next(rate for rate in rates if rate.per_second == middle)


def _show(medians: dict[str, Rate], ready: float, server: str, size: str) -> None:
    console = Console(width=None if sys.stdout.isatty() else 120)
    cores = os.cpu_count()
    table = Table(title=f"er-gym's player, FloorPlan1, {server.upper()}, {size}, {cores} cores")
    for heading in ("step", "steps/s", "client ms", "player ms", "waiting ms", "bound by"):
        table.add_column(heading, justify="left" if heading in ("step", "bound by") else "right")
    for name, rate in medians.items():
        times = (f"{value:.2f}" for value in (rate.client, rate.player, rate.waiting))
        table.add_row(name, f"{rate.per_second:.0f}", *times, rate.bound)
    console.print(table)
    console.print(f"ready to step {ready:.2f} s after launch")
    if server == "fifo":  # the client limits WSGI
        first = next(iter(medians.values()))
        verdict = "reached" if first.per_second >= _GOAL else "MISSED"
        console.print(f"goal of {_GOAL:.0f} Pass/s: {verdict}")


if __name__ == "__main__":
    main()
