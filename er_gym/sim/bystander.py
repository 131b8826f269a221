"""What an agent that did not act is told, and what it sees."""

from __future__ import annotations

from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.render.view import View, draw
from er_gym.sim.world import World


class Bystander:
    """What an agent that did not act is told, and what it sees.

    Its picture is drawn when somebody reads it: most programs look at the agent that acted. Code
    that is about to change an object has to call :meth:`settle` first.

    Args:
        metadata: of its event.
        own: the world as it is for this agent, a copy with poses of its own.
        third_party: the views of the third-party cameras; None if no picture was asked for.
    """

    __slots__ = ("__weakref__", "_own", "_third_party", "_view", "metadata")

    def __init__(
        self, metadata: LazyMetadata, own: World, third_party: tuple[View, ...] | None
    ) -> None:
        self.metadata = metadata
        self._own = None if third_party is None else own
        self._third_party = third_party
        self._view: View | None = None

    @property
    def undrawn(self) -> bool:
        """Whether a picture was asked for that is not drawn yet."""
        return self._own is not None

    @property
    def view(self) -> View | None:
        """Its images, None if no picture was asked for."""
        self.settle()
        return self._view

    def settle(self) -> None:
        """Draw the picture, and let go of the world."""
        own, self._own = self._own, None
        if own is not None:
            self._view = draw(own, self._third_party)
