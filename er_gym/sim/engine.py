"""The embedded engine: one action in, metadata and frames out. Dispatch, and nothing else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from er_gym.sim.actions import perform
from er_gym.sim.errors import INVALID_ARGUMENT, MISSING_ARGUMENTS, ActionFailed
from er_gym.sim.metadata import metadata
from er_gym.sim.render.view import View, draw
from er_gym.sim.scene import SCENE_NAMES, UnknownSceneError, load_scene
from er_gym.sim.world import Settings, World


class Engine:
    """A scene that answers AI2-THOR actions.

    Args:
        width, height: size of frames, pixels.
    """

    def __init__(self, width: int = 300, height: int = 300) -> None:
        self.world = World.load(load_scene(SCENE_NAMES[0]), Settings(width=width, height=height))

    def step(self, request: Mapping[str, Any]) -> tuple[dict[str, Any], View | None]:
        """Do one action, given as the AI2-THOR client sends it.

        Whatever goes wrong is said in the metadata (``lastActionSuccess``, ``errorMessage``,
        ``errorCode``); nothing is raised.

        Returns:
            The metadata, and the frames unless ``renderImage`` is False.
        """
        name = str(request.get("action"))
        try:
            if name == "Reset":
                self._reset(request)
                report = metadata(self.world, name)
            else:
                report = metadata(self.world, name, action_return=perform(self.world, request))
        except ActionFailed as failure:
            report = metadata(self.world, name, str(failure), failure.code)
        frames = draw(self.world) if request.get("renderImage", True) else None
        return report, frames

    def _reset(self, request: Mapping[str, Any]) -> None:
        name = request.get("sceneName")
        if not isinstance(name, str):
            raise ActionFailed("Reset needs sceneName, such as FloorPlan1.", MISSING_ARGUMENTS)
        try:
            scene = load_scene(name)
        except UnknownSceneError as error:
            raise ActionFailed(str(error), INVALID_ARGUMENT) from None
        size = self.world.settings
        self.world = World.load(scene, replace(Settings(), width=size.width, height=size.height))
