"""What the agent perceives, read from an AI2-THOR event.

Nothing keeps the event. The embedded engine makes an event's metadata lazily, and must complete the
metadata of an event that is still referenced before the world changes. That takes longer than the
action itself.
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
    """What the agent perceives in one state of the world.

    Attributes:
        objects: the N objects of the scene.
        visible, interactable: (N,) bool, AI2-THOR's ``visible`` and ``isInteractable``.
        pose: the agent's pose, metres and degrees in the world frame.
        frame: the agent's view, (height, width, 3) uint8; None if it was not drawn.
        boxes: object id to the box of its visible part, pixels (left, upper, right, lower); None
            unless the environment annotates pictures.
    """

    objects: ObjectTable
    visible: NDArray[np.bool_]
    interactable: NDArray[np.bool_]
    pose: AgentPose
    frame: NDArray[np.uint8] | None
    boxes: Mapping[str, tuple[int, int, int, int]] | None = None

    @cached_property
    def picture(self) -> NDArray[np.uint8] | None:
        """The frame, annotated with object types if the environment asks for it."""
        if self.frame is None or self.boxes is None:
            return self.frame
        return annotated(self.frame, self.boxes)

    @cached_property
    def visible_names(self) -> tuple[str, ...]:
        """The names of the visible object types, in alphabetical order."""
        return type_names(self.visible_types)

    @property
    def held_name(self) -> str:
        """The type of the object in the agent's hand, ``""`` if the hand is empty."""
        held = self.objects.held
        return "" if held < 0 else self.objects.type_of(held)

    @cached_property
    def visible_types(self) -> NDArray[np.bool_]:
        """(T,) bool: True for each visible object type."""
        return type_mask(self.objects.kinds[self.visible])


def perceive(event: Any) -> Perception:
    """Read what the agent perceives from an AI2-THOR event."""
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
    """(T,) bool: True for the types at the given indices into ``TYPES``."""
    mark = np.zeros(len(TYPES), dtype=bool)
    mark[kinds] = True
    return mark


def type_names(mark: NDArray[np.bool_]) -> tuple[str, ...]:
    """The names of the types that are True in a (T,) bool mask, in alphabetical order."""
    return tuple([TYPES[kind] for kind in mark.nonzero()[0].tolist()])
