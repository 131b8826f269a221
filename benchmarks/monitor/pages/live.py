"""What grows: whether a page that is open is still true.

Pages ask every moment, and each answer is brief. A browser has six connections to a server for all
its pages together, so an answer that stays open would leave none for the seventh page.
"""

from __future__ import annotations

from fastapi import Response
from fastapi.responses import PlainTextResponse

from benchmarks.monitor.site import Routes, Site


class LivePages:
    """See the file.

    Args:
        site: what is shown.
    """

    def __init__(self, site: Site) -> None:
        self._site = site

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/live": self.live}

    def live(self, of: str = "*") -> Response:
        """What changes whenever a directory does, or one of some with commas between, or any."""
        return PlainTextResponse(self._site.state_of(of, closely=True))
