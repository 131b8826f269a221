"""``make_controller``: the same Controller API on either engine."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from er_gym.houses.names import scene_of
from er_gym.thor.client_folder import Release

if TYPE_CHECKING:
    from ai2thor.controller import Controller  # half a second to import


class BackendError(RuntimeError):
    """An engine cannot be started on this machine; the message says what to do."""


RENDER_DEVICES = ("cpu", "gpu")
"""The devices that the embedded engine can draw with. The engine, which is too heavy to import
here, has the same list; a test compares them."""
LIGHTS = ("soft", "flat")
"""The lights that the embedded engine draws in; the same holds for this list."""


def _embedded(arguments: dict[str, Any]) -> Controller:
    from er_gym.sim.controller import EmbeddedController

    device = arguments.pop("render_device", None)
    if device is not None:
        from er_gym.sim.render.panda import use_device

        use_device(device)
    return EmbeddedController(**arguments)


def _unity(arguments: dict[str, Any]) -> Controller:
    if "DISPLAY" not in os.environ and "local_executable_path" not in arguments:
        from ai2thor.platform import CloudRendering

        arguments.setdefault("platform", CloudRendering)
    from ai2thor.controller import Controller

    if "local_executable_path" not in arguments:
        platform = arguments.get("platform", "Linux64")
        release = Release(platform if isinstance(platform, str) else platform.__name__)
        if release.is_ours:
            raise BackendError(
                f"er-gym's player is installed in place of Unity's build ({release.path}), so "
                "backend 'unity' would be the embedded engine again; er-gym player uninstall "
                "removes it"
            )
    try:
        return Controller(**arguments)
    except Exception as error:  # any exception means that Unity cannot run on this machine
        reason = (str(error).strip().splitlines() or [""])[0]
        raise BackendError(
            "backend 'unity' could not start AI2-THOR's Unity build "
            f"({type(error).__name__}: {reason}). "
            "It needs network access to download the build once, and a GPU driver with Vulkan "
            "(libvulkan1) or an X display. backend='embedded' needs none of that."
        ) from error


BACKENDS: dict[str, Callable[[dict[str, Any]], Controller]] = {
    "embedded": _embedded,
    "unity": _unity,
}


def make_controller(backend: str = "embedded", **arguments: Any) -> Controller:
    """Start an AI2-THOR controller.

    Args:
        backend: "embedded" (our engine, in this process) or "unity" (the real simulator;
            CloudRendering when there is no display).
        **arguments: the arguments of ``ai2thor.controller.Controller``; ``scene`` may be the name
            of a house, such as ``House3-17``. The embedded engine also
            takes ``render_device``: "cpu" or "gpu", the same for the whole process; and ``light``:
            "soft", from windows and lamps and with soft shadows, or "flat", the same everywhere.

    Raises:
        ValueError: the backend is unknown.
        BackendError: the engine cannot be started on this machine.
    """
    start = BACKENDS.get(backend)
    if start is None:
        raise ValueError(f"unknown backend {backend!r}; choose one of: {', '.join(BACKENDS)}")
    if isinstance(scene := arguments.get("scene"), str):
        arguments["scene"] = scene_of(scene)
    return start(dict(arguments))
