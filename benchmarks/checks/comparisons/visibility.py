"""What is visible from the 40 recorded start poses."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from er_gym.thor import make_controller


@dataclass(frozen=True)
class VisibilityAgreement:
    """Counts of objects: claimed and recorded, claimed only, recorded only."""

    right: int
    false: int
    missed: int

    @property
    def precision(self) -> float:
        return self.right / (self.right + self.false)

    @property
    def recall(self) -> float:
        return self.right / (self.right + self.missed)

    @property
    def f1(self) -> float:
        return 2 * self.right / (2 * self.right + self.false + self.missed)


def visible_objects(
    captures: Mapping[str, Any], scenes: Iterable[str] | None = None, turn: float = 0.0
) -> VisibilityAgreement:
    """Compare over some scenes, all by default; objects that the scene tables lack do not count.

    Args:
        turn: degrees to turn the agent away from the recorded heading, for a comparison that
            has to fail.
    """
    right = false = missed = 0
    controller = make_controller(headless=True)
    for scene in captures if scenes is None else scenes:
        capture = captures[scene]
        agent, (width, height) = capture["agent"], capture["screen"]
        controller.reset(scene, width=width, height=height, fieldOfView=capture["fov"])
        event = controller.step(
            action="TeleportFull",
            position=dict(zip("xyz", agent["position"], strict=True)),
            rotation=agent["rotation"] + turn,
            horizon=agent["cameraHorizon"],
            standing=agent["isStanding"],
            forceAction=True,
        )
        there = {entry["objectId"] for entry in event.metadata["objects"]}
        seen = {e["objectId"] for e in event.metadata["objects"] if e["visible"]}
        recorded = there & set(capture["visible"])
        right += len(seen & recorded)
        false += len(seen - recorded)
        missed += len(recorded - seen)
    controller.stop()
    return VisibilityAgreement(right, false, missed)
