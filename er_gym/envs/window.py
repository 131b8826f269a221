"""The window of ``render_mode="human"``, with pygame as Gymnasium's own environments."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

_NOWHERE = ("dummy", "offscreen")
"""SDL's drivers that show nothing."""


class Window:
    """Shows pictures one after another; it opens with the first.

    Args:
        title: of the window.
    """

    def __init__(self, title: str) -> None:
        self._title = title
        self._pygame: Any = None
        self._screen: Any = None

    def show(self, picture: NDArray[np.uint8], per_second: float) -> None:
        """Show a picture, no sooner than the last one's time is over.

        Args:
            picture: (height, width, 3) uint8.
            per_second: how many pictures are shown in a second.

        Raises:
            gymnasium.error.DependencyNotInstalled: pygame is not installed.
            gymnasium.error.Error: the window cannot be opened.
        """
        if self._screen is None:
            self._open(picture.shape[1], picture.shape[0])
        self._screen.blit(self._pygame.surfarray.make_surface(picture.swapaxes(0, 1)), (0, 0))
        self._pygame.event.pump()
        self._pygame.display.flip()
        self._clock.tick(per_second)

    def close(self) -> None:
        """Close the window; :meth:`show` opens it again."""
        if self._screen is not None:
            self._screen = None
            self._pygame.display.quit()

    def _open(self, width: int, height: int) -> None:
        try:
            # Imported by name and late: it is no part of the core.
            pygame = self._pygame = import_module("pygame")
        except ImportError as error:
            raise gymnasium.error.DependencyNotInstalled(
                f"render_mode='human' needs pygame ({error}): pip install 'er-gym[render]'; "
                "render_mode='rgb_array' and 'ansi' need nothing"
            ) from error
        try:
            pygame.display.init()
            self._screen = pygame.display.set_mode((width, height))
            pygame.display.set_caption(self._title)
        except pygame.error as error:
            raise gymnasium.error.Error(
                f"render_mode='human' cannot open a window ({error}); take render_mode='rgb_array' "
                "or 'ansi', or record a video with gymnasium.wrappers.RecordVideo"
            ) from error
        self._clock = pygame.time.Clock()
        if pygame.display.get_driver() in _NOWHERE and "SDL_VIDEODRIVER" not in os.environ:
            gymnasium.logger.warn(
                "render_mode='human' finds no display, so nothing is shown; take "
                "render_mode='rgb_array' or 'ansi', or gymnasium.wrappers.RecordVideo"
            )
