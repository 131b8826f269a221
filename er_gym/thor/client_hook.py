"""Lets AI2-THOR's client start er-gym's player on machines without X server and Vulkan.

The client tests the machine for what Unity needs before it starts a build. If er-gym's player is
installed in place of the build, this hook makes the tests pass. A real build is tested as usual.
``er-gym player install`` copies this file into the site-packages of its Python, where a ``.pth``
file calls :func:`activate` when Python starts. The file thus needs only the standard library and
imports as little as possible.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False  # typing's own takes 10 ms to import, whenever a Python starts
if TYPE_CHECKING:
    from typing import Any

MARKER = "installed-by-er-gym.json"
"""The file in a release folder that marks er-gym's player."""
PLATFORMS = ("Linux64", "CloudRendering")
"""The client's platforms whose builds er-gym's player replaces."""
_TARGET = "ai2thor.platform"


def activate() -> None:
    """Adapt the client's module of platforms when it is imported."""
    if _Finder not in sys.meta_path:
        sys.meta_path.insert(0, _Finder)


class _Finder:
    """Finds the module of platforms as Python does, and adapts it after it is loaded."""

    @classmethod
    def find_spec(cls, name: str, path: Any = None, target: Any = None) -> Any:
        if name != _TARGET:
            return None
        from importlib.machinery import PathFinder

        spec = PathFinder.find_spec(name, path)
        if spec is None or spec.loader is None:
            return None
        loader: Any = spec.loader
        execute = loader.exec_module

        def execute_and_adapt(module: Any) -> None:
            execute(module)
            for platform in PLATFORMS:
                if hasattr(module, platform):
                    _adapt(getattr(module, platform))

        loader.exec_module = execute_and_adapt
        return spec


def _adapt(platform: Any) -> None:
    validate, launch_env = platform.validate, platform.launch_env

    def validate_unless_ours(cls: Any, request: Any) -> Any:
        return [] if _is_ours(cls.__name__) else validate(request)

    def launch_env_unless_ours(cls: Any, width: int, height: int, x_display: str | None) -> Any:
        # With no display to name, the client would put None into the environment.
        if x_display is None and _is_ours(cls.__name__):
            return {}
        return launch_env(width, height, x_display)

    platform.validate = classmethod(validate_unless_ours)
    platform.launch_env = classmethod(launch_env_unless_ours)


def _is_ours(platform: str) -> bool:
    from ai2thor._builds import COMMIT_ID

    release = f"~/.ai2thor/releases/thor-{platform}-{COMMIT_ID}"
    return os.path.isfile(os.path.join(os.path.expanduser(release), MARKER))
