"""What the agent perceives, taken out of an event at once.

The event can then be let go. One that somebody keeps has to have all its metadata worked out before
the world changes, which costs the embedded engine more than the action itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.annotate import annotated
from er_gym.tasks.task import AgentPose
from er_gym.thor.objects import TYPES, ObjectTable, objects_of


@dataclass(frozen=True, eq=False)
class Perception:
    """What an event tells the agent.

    Attributes:
        objects: the N objects of the scene, as they are then.
        visible, interactable: (N,) bool, as the simulator has them.
        pose: the agent's.
        frame: its view, (height, width, 3) uint8; None when none was drawn.
        boxes: object id to what is seen of it, in pixels (left, upper, right, lower); None unless
            the picture is to name things.
    """

    objects: ObjectTable
    visible: NDArray[np.bool_]
    interactable: NDArray[np.bool_]
    pose: AgentPose
    frame: NDArray[np.uint8] | None
    boxes: Mapping[str, tuple[int, int, int, int]] | None = None

    @cached_property
    def picture(self) -> NDArray[np.uint8] | None:
        """The frame, with things named in it if they are to be."""
        if self.frame is None or self.boxes is None:
            return self.frame
        return annotated(self.frame, self.boxes)

    @cached_property
    def visible_names(self) -> tuple[str, ...]:
        """The names of the types of which something is visible, in alphabetical order."""
        return type_names(self.visible_types)

    @property
    def held_name(self) -> str:
        """The type of what is in the hand, ``""`` when that is empty."""
        held = self.objects.held
        return "" if held < 0 else self.objects.type_of(held)

    @cached_property
    def visible_types(self) -> NDArray[np.bool_]:
        """(T,) bool: the types of which something is visible."""
        return type_mask(self.objects.kinds[self.visible])


def perceive(event: Any) -> Perception:
    """What an AI2-THOR event tells the agent."""
    objects, visible, interactable = objects_of(event)
    agent = event.metadata["agent"]
    position = agent["position"]
    pose = AgentPose(
        position["x"],
        position["y"],
        position["z"],
        agent["rotation"]["y"],
        agent["cameraHorizon"],
        agent["isStanding"],
    )
    return Perception(
        objects, visible, interactable, pose, event.frame, event.instance_detections2D
    )


def type_mask(kinds: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(T,) bool: True for the types that occur among some kinds, indices into ``TYPES``."""
    mark = np.zeros(len(TYPES), dtype=bool)
    mark[kinds] = True
    return mark


def type_names(mark: NDArray[np.bool_]) -> tuple[str, ...]:
    """The names of the types that are marked in (T,) bool, in alphabetical order."""
    return tuple([TYPES[kind] for kind in mark.nonzero()[0].tolist()])
