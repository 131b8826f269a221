"""What belongs to an agent while another one acts."""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.sim.agent import Agent
from er_gym.sim.carrying import Hand


@dataclass(frozen=True)
class Waiting:
    """What belongs to an agent that is not acting.

    Attributes:
        agent: its pose.
        field_of_view: of its camera, vertical, degrees.
        held: row of the object in its hand, -1 if the hand is empty.
        hand: the hand while it is not at rest, None while it is.
        map_view: whether its picture shows the room from above.
    """

    agent: Agent
    field_of_view: float
    held: int = -1
    hand: Hand | None = None
    map_view: bool = False
