"""Measures what two agents in one controller cost, against two controllers with one agent each.

    python -m benchmarks.perf.agents [--steps 400] [--rounds 5] [--agents 2]

Both play the same steps: the agents take turns, and after each step the program reads what the
acting agent sees. Figures are of processor time, so other programs on the machine matter little.
The candidates take turns, and the median of the rounds is printed.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import click

from benchmarks.harness.output import print_table
from er_gym.sim.controller import EmbeddedController
from er_gym.sim.crew import MOST_AGENTS

GOAL = 0.8
"""Of the speed of as many controllers."""
ROOM = "FloorPlan1"
_TURN = ("RotateRight", "MoveAhead", "RotateRight", "MoveAhead", "LookDown", "LookUp")
KINDS: dict[str, dict[str, Any]] = {
    "no images": {"headless": True},
    "rgb 300×300": {"width": 300, "height": 300},
}

Step = Callable[[int, str], Any]


def rate(step: Step, agents: int, steps: int) -> float:
    """Steps per second of processor time; each agent does ``steps``."""
    start = time.process_time()
    for k in range(steps):
        for agent in range(agents):
            event = step(agent, _TURN[k % len(_TURN)])
            sum(entry["visible"] for entry in event.metadata["objects"])
    return steps * agents / (time.process_time() - start)


def together(agents: int, settings: dict[str, Any]) -> Step:
    """The steps of some agents in one controller."""
    controller = EmbeddedController(scene=ROOM, agentCount=agents, **settings)
    return lambda agent, action: controller.step(action, agentId=agent)


def apart(agents: int, settings: dict[str, Any]) -> Step:
    """The steps of one agent in each of some controllers, which start where those together do."""
    first = EmbeddedController(scene=ROOM, agentCount=agents, **settings)
    starts = [event.metadata["agent"] for event in first.step("Pass").events]
    first.stop()
    controllers = []
    for start in starts:
        controller = EmbeddedController(scene=ROOM, **settings)
        controller.step("Teleport", position=start["position"], rotation=start["rotation"])
        controllers.append(controller)
    return lambda agent, action: controllers[agent].step(action)


def measured(agents: int, steps: int, rounds: int) -> list[tuple[str, float, float]]:
    """For each kind of picture the median rates together and apart."""
    found = []
    for name, settings in KINDS.items():
        candidates = [make(agents, settings) for make in (together, apart)]
        rates: Sequence[list[float]] = ([], [])
        for step in candidates:
            rate(step, agents, len(_TURN))  # what is remembered from one look to the next
        for _ in range(rounds):
            for step, into in zip(candidates, rates, strict=True):
                into.append(rate(step, agents, steps))
        found.append((name, statistics.median(rates[0]), statistics.median(rates[1])))
    return found


@click.command()
@click.option("--steps", default=400, show_default=True, type=click.IntRange(1))
@click.option("--rounds", default=5, show_default=True, type=click.IntRange(1))
@click.option("--agents", default=2, show_default=True, type=click.IntRange(2, MOST_AGENTS))
def main(steps: int, rounds: int, agents: int) -> None:
    """Print the rates; exit code 1 if those together miss the goal."""
    rows = measured(agents, steps, rounds)
    print_table(
        "Steps a second of processor time",
        ("", "one controller", f"{agents} controllers", "share"),
        [(name, f"{one:.0f}", f"{other:.0f}", f"{one / other:.2f}") for name, one, other in rows],
    )
    raise SystemExit(any(one < GOAL * other for _, one, other in rows))


if __name__ == "__main__":
    main()
