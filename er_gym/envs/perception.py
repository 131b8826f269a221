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
from er_gym.envs.object_view import ObjectView, views_of_objects
from er_gym.tasks.task import AgentPose
from er_gym.thor.calls import Seen, seen_in
from er_gym.thor.objects import TYPES, ObjectTable

SENSORS: Mapping[str, Mapping[str, bool]] = {
    "frame": {},
    "depth": {"renderDepthImage": True},
    "instances": {"renderInstanceSegmentation": True},
    "classes": {"renderSemanticSegmentation": True},
}
"""The sensors by the attribute of :class:`Perception` that holds their image, each with the
arguments of the AI2-THOR controller that switch it on. A frame is there whenever anything is
drawn."""

_WITHOUT_ALPHA = 0xFFFFFF


@dataclass(frozen=True, eq=False)
class Perception:
    """What the agent perceives in one state of the world.

    Attributes:
        objects: the N objects of the scene.
        visible, interactable: (N,) bool, AI2-THOR's ``visible`` and ``isInteractable``.
        pose: the agent's pose, metres and degrees in the world frame.
        frame: the agent's view, (height, width, 3) uint8; None if it was not drawn.
        depth: (height, width) float32 metres along the view axis; None if it was not asked for.
        masks: AI2-THOR's instance masks by object id; None if they were not asked for.
        classes: (height, width, 3) uint8, a colour for each object type; None if it was not asked
            for.
        boxes: object id to the box of its visible part, pixels (left, upper, right, lower); None
            without instance masks.
    """

    objects: ObjectTable
    visible: NDArray[np.bool_]
    interactable: NDArray[np.bool_]
    pose: AgentPose
    frame: NDArray[np.uint8] | None
    depth: NDArray[np.float32] | None = None
    masks: Any = None
    classes: NDArray[np.uint8] | None = None
    boxes: Mapping[str, tuple[int, int, int, int]] | None = None

    @cached_property
    def annotated(self) -> NDArray[np.uint8] | None:
        """The frame annotated with object types; the plain frame without instance masks."""
        if self.frame is None or self.boxes is None:
            return self.frame
        return annotated(self.frame, self.boxes)

    @cached_property
    def instances(self) -> NDArray[np.int32] | None:
        """(height, width) int32: 1 + the row in ``objects`` of the object at each pixel, 0 for the
        room; None without instance masks. Read-only."""
        if self.masks is None:
            return None
        assert self.frame is not None  # masks come with a frame
        found = _rows_of_pixels(self.masks, self.objects.row)
        return found.reshape(self.frame.shape[:2])  # the client squeezes them, as it does depth

    @cached_property
    def visible_names(self) -> tuple[str, ...]:
        """The names of the visible object types, in alphabetical order."""
        return type_names(self.visible_types)

    @cached_property
    def object_views(self) -> tuple[ObjectView, ...]:
        """The objects in view without the held one and the floor, nearest first."""
        return views_of_objects(self.objects, self.visible, self.pose)

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
    return perception_of(seen_in(event))


def perception_of(seen: Seen) -> Perception:
    """What the agent perceives, from what AI2-THOR tells."""
    objects, visible, interactable, (x, y, z), rotation, horizon, standing, event = seen
    pose = AgentPose(x, y, z, rotation, horizon, standing)
    if event is None:
        return Perception(objects, visible, interactable, pose, None)
    boxes, depth = event.instance_detections2D, event.depth_frame
    return Perception(
        objects=objects,
        visible=visible,
        interactable=interactable,
        pose=pose,
        frame=event.frame,
        # The client squeezes it, so that a picture of one row would lose a dimension.
        depth=None if depth is None else depth.reshape(event.frame.shape[:2]),
        masks=None if boxes is None else event.instance_masks,
        classes=event.semantic_segmentation_frame,
        boxes=boxes,
    )


def _rows_of_pixels(masks: Any, row: Mapping[str, int]) -> NDArray[np.int32]:
    """(P,) 1 + the row of the object at each pixel, from the colours of instance masks.

    Neighbouring pixels mostly have one colour, so a colour is looked up once for each run of equal
    pixels: masks of all objects, one after another, take twenty times as long.
    """
    pixels = np.ascontiguousarray(masks.instance_segmentation_frame_uint32).ravel()
    starts = np.flatnonzero(np.concatenate(([True], pixels[1:] != pixels[:-1])))
    number_of = {
        red | green << 8 | blue << 16: row[object_id] + 1
        for object_id, (red, green, blue) in masks.instance_colors.items()
        if object_id in row
    }
    keys = (pixels[starts] & _WITHOUT_ALPHA).tolist()
    numbers = np.array([number_of.get(key, 0) for key in keys], dtype=np.int32)
    found = np.repeat(numbers, np.diff(starts, append=pixels.size))
    found.setflags(write=False)
    return found


def type_mask(kinds: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(T,) bool: True for the types at the given indices into ``TYPES``."""
    mark = np.zeros(len(TYPES), dtype=bool)
    mark[kinds] = True
    return mark


def type_names(mark: NDArray[np.bool_]) -> tuple[str, ...]:
    """The names of the types that are True in a (T,) bool mask, in alphabetical order."""
    return tuple([TYPES[kind] for kind in mark.nonzero()[0].tolist()])
