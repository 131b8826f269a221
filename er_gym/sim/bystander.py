"""What an agent that did not act is told, and what it sees."""

from __future__ import annotations

from collections.abc import Callable

from er_gym.sim.crew import as_agent
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.render.view import View, draw
from er_gym.sim.world import World

Told = Callable[[World], LazyMetadata]
"""Makes an agent's metadata from the world as it is for this agent."""


class Bystander:
    """What an agent that did not act is told, and what it sees.

    Both are made when somebody reads them: most programs look at the agent that acted. Code that is
    about to change an object has to call :meth:`settle` first, and ``settle`` of metadata that were
    read.

    Args:
        world: a copy, with poses of its own.
        number: of the agent.
        told: makes its metadata.
        third_party: the views of the third-party cameras; None if no picture was asked for.
        read: is given the metadata when they are made.
    """

    __slots__ = (
        *("__weakref__", "_metadata", "_number", "_own", "_read", "_third_party", "_told"),
        *("_view", "_world"),
    )

    def __init__(
        self,
        world: World,
        number: int,
        told: Told,
        third_party: tuple[View, ...] | None,
        read: Callable[[LazyMetadata], None],
    ) -> None:
        self._world: World | None = world
        self._number, self._told, self._read = number, told, read
        self._third_party = third_party
        self._own: World | None = None
        self._metadata: LazyMetadata | None = None
        self._view: View | None = None

    @property
    def pictureless(self) -> bool:
        """Whether no picture was asked for."""
        return self._third_party is None and self._view is None

    @property
    def metadata(self) -> LazyMetadata:
        """The metadata of its event."""
        if self._metadata is None:
            self._metadata = self._told(self._for_it())
            self._read(self._metadata)
        return self._metadata

    @property
    def view(self) -> View | None:
        """Its images, None if no picture was asked for."""
        cameras, self._third_party = self._third_party, None
        if cameras is not None:
            self._view = draw(self._for_it(), cameras)
        return self._view

    def settle(self) -> None:
        """Make all of it, and let go of the world."""
        self.metadata.settle()
        _ = self.view
        self._own = self._world = None

    def _for_it(self) -> World:
        """The world as it is for this agent."""
        if self._own is None:
            assert self._world is not None  # nobody asks for more after all was made
            self._own = as_agent(self._world, self._number)
        return self._own
