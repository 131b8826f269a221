"""Houses by name: ``House3-17`` is made anew, a house of the user's is known while this runs."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

_GENERATED = re.compile(r"House([1-6])-(\d{1,9})")
_GIVEN = re.compile(r"House_[0-9a-f]{16}")
_given: dict[str, Mapping[str, Any]] = {}


def house_name(seed: int, rooms: int) -> str:
    """The name of a generated house."""
    return f"House{rooms}-{seed}"


def is_house(scene: str) -> bool:
    """Whether a scene's name is that of a house."""
    return bool(_GENERATED.fullmatch(scene)) or scene in _given


def named(house: Mapping[str, Any]) -> str:
    """A name for a house in ProcTHOR's JSON, by which this process knows it from now on.

    Raises:
        HouseError: the house cannot be built; the message says why.
    """
    from er_gym.houses.generate import generate_house
    from er_gym.sim.house.build import house_scene

    own = house.get("metadata", {}).get("name", "")
    match = _GENERATED.fullmatch(own) if isinstance(own, str) else None
    if match and generate_house(int(match[2]), int(match[1])) == house:
        return str(own)
    name = house_scene(house).name
    _given[name] = house
    return name


def scene_of(name: str) -> Any:
    """What a Controller's ``reset`` takes for a scene's name: a house, or the name itself.

    Raises:
        ValueError: it is the name of another process's house.
    """
    if name.startswith("FloorPlan"):
        return name
    match = _GENERATED.fullmatch(name)
    if match:
        from er_gym.houses.generate import generate_house  # late: few programs need it

        return generate_house(int(match[2]), int(match[1]))
    if name in _given:
        return _given[name]
    if _GIVEN.fullmatch(name):
        raise ValueError(
            f"{name} is a house that another process was given; give it to this one as well: "
            "er_gym.houses.named(house)"
        )
    return name
