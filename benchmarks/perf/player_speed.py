"""Measures how fast the player answers the official client, and what limits the speed.

    python -m benchmarks.perf.player_speed [--seconds 2] [--rounds 3] [--width 300] [--height 300]
                                        [--server fifo|wsgi]

Each sort of step is timed through the official client. The client reports the processor time of its
own work; the player's is read from the kernel. The rest is waiting: pipes, the scheduler, other
programs.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click

from benchmarks.harness.measuring import in_turns
from benchmarks.harness.output import print_table

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

    def rate_of(name: str) -> Rate:
        requests = STEPS[name]
        controller.reset(fastActionEmit="whole" not in name)

        def step() -> None:
            for request in requests:
                controller.step(**request, raise_for_failure=True)

        rate, each = measure(step, pid, seconds), len(requests)
        return Rate(rate.per_second * each, rate.client / each, rate.player / each)

    found = in_turns({name: partial(rate_of, name) for name in STEPS}, rounds)
    controller.stop()
    medians = {name: _median(rates) for name, rates in found.items()}
    _show(medians, ready, server, f"{width}×{height}")


def _median(rates: list[Rate]) -> Rate:
    return sorted(rates, key=lambda rate: rate.per_second)[(len(rates) - 1) // 2]


def _show(medians: dict[str, Rate], ready: float, server: str, size: str) -> None:
    rows = [
        (
            name,
            f"{rate.per_second:.0f}",
            *(f"{value:.2f}" for value in (rate.client, rate.player, rate.waiting)),
            rate.bound,
        )
        for name, rate in medians.items()
    ]
    notes = [f"ready to step {ready:.2f} s after launch"]
    if server == "fifo":  # the client limits WSGI
        reached = next(iter(medians.values())).per_second >= _GOAL
        notes.append(f"goal of {_GOAL:.0f} Pass/s: {'reached' if reached else 'MISSED'}")
    title = f"er-gym's player, FloorPlan1, {server.upper()}, {size}, {os.cpu_count()} cores"
    head = ("step", "steps/s", "client ms", "player ms", "waiting ms", "bound by")
    print_table(title, head, rows, notes=notes)


if __name__ == "__main__":
    main()
