"""News of what grows, as server-sent events."""

from __future__ import annotations

import threading
from functools import partial

from fastapi import Request, Response
from starlette.concurrency import run_in_threadpool

from benchmarks.monitor.news import news
from benchmarks.monitor.site import Routes, Site

_LOOK_SECONDS = 0.7
"""How often a page's directories are looked at while a browser waits for news."""


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
        asked = frozenset(of[:2000].split(","))
        look = partial(run_in_threadpool, self._version, asked)
        return news(request, self._closing, look, _LOOK_SECONDS)

    def _version(self, of: frozenset[str]) -> object:
        """What changes whenever one of the directories does."""
        directories = [each for each in self._site.directories.all() if "*" in of or each.id in of]
        return tuple(
            (directory.id, self._site.version(directory, closely=directory.id in of))
            for directory in directories
        )
