"""The side effects of the world: running water washes and fills, heat cooks, the fridge cools.

:func:`apply` runs after every action that changes the world. Running it twice changes nothing more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from er_gym.sim.world import World

HOT, COLD = "Hot", "Cold"
_SINK_REACH = 1.0
"""A faucet feeds the nearest basin within this distance, metres."""


def _basin_of(world: World, faucet: int) -> int | None:
    """The row of the nearest basin, which the faucet runs into; None if none is near."""
    basins = list(world.of_type("SinkBasin", "BathtubBasin")) or list(
        world.of_type("Sink", "Bathtub")
    )
    if not basins:
        return None
    centres = (world.low[basins] + world.high[basins]) / 2
    middle = (world.low[faucet] + world.high[faucet]) / 2
    gaps = np.linalg.norm((centres - middle)[:, [0, 2]], axis=1)
    nearest = int(gaps.argmin())
    return basins[nearest] if gaps[nearest] <= _SINK_REACH else None


def fill(world: World, i: int, liquid: str) -> None:
    """Fill object i. A vessel that is filled already keeps its liquid."""
    if world.has(i, "canFillWithLiquid") and not world.state(i, "isFilledWithLiquid"):
        world.set_state(i, "isFilledWithLiquid", True)
        world.fill_liquid[i] = liquid


def cook(world: World, i: int) -> None:
    """Heat object i, and cook it if it is cookable."""
    world.set_temperature(i, HOT)
    if world.has(i, "cookable") and not world.state(i, "isCooked"):
        world.set_state(i, "isCooked", True)


def _run_faucet(world: World, faucet: int) -> None:
    basin = _basin_of(world, faucet)
    if basin is None:
        return
    for i in world.inside(basin):
        if world.state(i, "isDirty"):
            world.set_state(i, "isDirty", False)
        fill(world, i, "water")


def _heat_contents(world: World, appliance: int) -> None:
    for i in world.inside(appliance):
        cook(world, i)


def _burn(world: World, knob: int) -> None:
    for burner in world.controlled[knob] or ():
        _heat_contents(world, burner)


def _brew(world: World, machine: int) -> None:
    for i in world.inside(machine):
        fill(world, i, "coffee")


_WHILE_ON: dict[str, Callable[[World, int], None]] = {
    "Faucet": _run_faucet,
    "ShowerHead": _run_faucet,
    "StoveKnob": _burn,
    "Toaster": _heat_contents,
    "Microwave": _heat_contents,
    "CoffeeMachine": _brew,
}


def _switched_on(world: World) -> Iterator[tuple[int, Callable[[World, int], None]]]:
    for i in world.of_type(*_WHILE_ON):
        if world.state(i, "isToggled"):
            yield i, _WHILE_ON[world.types[i]]


def apply(world: World) -> None:
    """Apply the effects of everything that is switched on, and of the fridges."""
    for i, effect in _switched_on(world):
        effect(world, i)
    for fridge in world.of_type("Fridge"):
        for i in world.inside(fridge):
            world.set_temperature(i, COLD)
