"""News of what grows, as server-sent events."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator

from fastapi import Request, Response
from fastapi.responses import StreamingResponse
from starlette.concurrency import run_in_threadpool

from benchmarks.monitor.site import Routes, Site

_LOOK_SECONDS = 0.7
"""How often a page's directories are looked at while a browser waits for news."""
_BEAT_SECONDS = 15.0
"""A line is sent at least so often, so that both sides notice a lost connection."""


class LivePages:
    """See the file.

    Args:
        site: what is shown.
        closing: once it is set, nobody waits for news any more.
    """

    def __init__(self, site: Site, closing: threading.Event) -> None:
        self._site, self._closing = site, closing

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/live": self.live}

    async def live(self, request: Request, of: str = "*") -> Response:
        """News of a directory, of some with commas between, or of all: an event for each change."""
        return StreamingResponse(
            self._news(request, frozenset(of[:2000].split(","))),
            media_type="text/event-stream",
            headers={"X-Accel-Buffering": "no"},
        )

    async def _news(self, request: Request, of: frozenset[str]) -> AsyncIterator[str]:
        yield "retry: 1000\n\n"
        told, silent = await run_in_threadpool(self._version, of), 0.0
        while not (self._closing.is_set() or await request.is_disconnected()):
            await asyncio.sleep(_LOOK_SECONDS)
            now = await run_in_threadpool(self._version, of)
            silent += _LOOK_SECONDS
            if now != told:
                told, silent = now, 0.0
                yield "event: change\ndata: 1\n\n"
            elif silent >= _BEAT_SECONDS:
                silent = 0.0
                yield ": still here\n\n"

    def _version(self, of: frozenset[str]) -> object:
        """What changes whenever one of the directories does."""
        places = [each for each in self._site.places.all() if "*" in of or each.id in of]
        return tuple(
            (place.id, self._site.version(place, closely=place.id in of)) for place in places
        )
