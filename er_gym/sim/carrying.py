"""Where the hand holds things, once a program has moved or turned it (``RotateHeldObject``).

At rest the hand is in front of the camera and upright, and what it holds is as it was picked up.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import HAND_OFFSET, Agent
from er_gym.sim.rotation import unity_angles, unity_rotation
from er_gym.sim.scene_objects import SceneObjects

Floats = NDArray[np.float64]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Kept:
    """An object in the hand as it was before the hand turned.

    Attributes:
        row: of the object.
        rotation: degrees.
        offset: of its position from that of the held object, metres.
        low, high: the corners of its box from its own position, metres. A recorded box need not be
            that of the recorded edges.
    """

    row: int
    rotation: Triple
    offset: Triple
    low: Triple
    high: Triple


@dataclass(frozen=True)
class Hand:
    """A hand that is not at rest.

    Attributes:
        shift: from its place at rest, in the camera's frame (right, up, forward), metres.
        turn: its rotation in the camera's frame, Unity's angles in degrees; None as at rest.
        heading: of the agent when the hand began to turn, degrees.
        kept: what it holds, as it was then.
    """

    shift: Triple = (0.0, 0.0, 0.0)
    turn: Triple | None = None
    heading: float = 0.0
    kept: tuple[Kept, ...] = ()


def camera_rotation(agent: Agent) -> Floats:
    """(3, 3) from the camera's frame to the world's."""
    return unity_rotation(np.array([agent.horizon, agent.rotation, 0.0]))


def hand_point(agent: Agent, hand: Hand | None) -> Floats:
    """(3,) where the hand is, metres."""
    offset = HAND_OFFSET if hand is None else HAND_OFFSET + hand.shift
    return np.asarray(agent.camera + camera_rotation(agent) @ offset)


def hand_rotation(agent: Agent, hand: Hand | None) -> Floats:
    """(3, 3) from the hand's frame to the world's. At rest the hand is upright."""
    if hand is None or hand.turn is None:
        return unity_rotation(np.array([0.0, agent.rotation, 0.0]))
    return np.asarray(camera_rotation(agent) @ unity_rotation(np.array(hand.turn)))


def in_camera_frame(agent: Agent, rotation: Floats) -> Triple:
    """A rotation (3, 3) of the world as Unity's angles in the camera's frame, degrees."""
    return unity_angles(camera_rotation(agent).T @ rotation)


def turning(objects: SceneObjects, agent: Agent, hand: Hand | None, turn: Triple) -> Hand:
    """The hand with another rotation in the camera's frame, degrees."""
    if hand is not None and hand.turn is not None:
        return replace(hand, turn=turn)
    at, kept = objects.position[objects.held], []
    for row in objects.in_hand:
        own = objects.position[row]
        away = (each[row] - own for each in (objects.low, objects.high))
        kept.append(
            Kept(row, _triple(objects.rotation[row]), _triple(own - at), *map(_triple, away))
        )
    return replace(hand or Hand(), turn=turn, heading=agent.rotation, kept=tuple(kept))


def poses(objects: SceneObjects, agent: Agent, hand: Hand) -> Iterator[tuple[int, Floats, Floats]]:
    """Where what a turned hand holds belongs: rows, positions (3,) in metres, rotations (3,) in
    degrees. The held object keeps its position."""
    origin = objects.position[objects.held].copy()
    by = hand_rotation(agent, hand) @ unity_rotation(np.array([0.0, hand.heading, 0.0])).T
    for each in still_held(objects, hand):
        turned = unity_angles(by @ unity_rotation(np.array(each.rotation)))
        yield each.row, origin + by @ np.array(each.offset), np.array(turned)


def still_held(objects: SceneObjects, hand: Hand) -> Iterator[Kept]:
    """What a hand still holds of what it held when it began to turn."""
    rows = set(objects.in_hand)
    return (each for each in hand.kept if each.row in rows)


def tilt(agent: Agent, hand: Hand | None) -> float:
    """How far the hand leans from upright, degrees: 180 upside down."""
    up = float(np.clip(hand_rotation(agent, hand)[1, 1], -1.0, 1.0))
    return float(np.degrees(np.arccos(up)))


def _triple(values: Floats) -> Triple:
    x, y, z = values.tolist()
    return x, y, z
