"""What a room alone gives away: an agent that does not read the instruction, and guesses one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from agents.scripted.searcher.agent import SearcherAgent
from er_gym.envs.info import names
from er_gym.tasks.task import Task
from er_gym.thor import OBJECT_TYPES


class InstructionBlindAgent(SearcherAgent):
    """The searcher with an instruction that it makes up about a thing that it sees at first.

    Args:
        seed: of its guesses.
    """

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode: guess what is asked."""
        guess = self._guess(set(names(info["visible_mask"])))
        super().reset(replace(task, instruction=guess), obs, info)

    def _guess(self, seen: set[str]) -> str:
        """An instruction about one of these types, or about any if none of them will do."""
        handy = _with("pickupable", seen) or _with("pickupable", {*OBJECT_TYPES})
        switches, places = _with("toggleable", seen), _with("receptacle", seen)
        thing = self._random.choice(handy)
        guesses = [f"Find the {thing}.", f"Pick up the {thing}."]
        if switches:
            guesses.append(f"Toggle the {self._random.choice(switches)}.")
        if places:
            guesses.append(f"Put the {thing} in the {self._random.choice(places)}.")
        return str(self._random.choice(guesses))


def _with(name: str, types: set[str]) -> list[str]:
    """Those of some object types that have a property, in alphabetical order."""
    return sorted(each for each in types if name in OBJECT_TYPES[each].properties)
