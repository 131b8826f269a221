"""The monitor as a FastAPI application: its pages, and who may see them."""

from __future__ import annotations

import hmac
import threading
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlencode

from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse, PlainTextResponse, RedirectResponse
from starlette.concurrency import run_in_threadpool
from starlette.middleware.base import RequestResponseEndpoint

from benchmarks.monitor.directories import Directories
from benchmarks.monitor.pages.compare import ComparePages
from benchmarks.monitor.pages.data import DataPages
from benchmarks.monitor.pages.episodes import EpisodePages
from benchmarks.monitor.pages.live import LivePages
from benchmarks.monitor.pages.noting import NotingPages
from benchmarks.monitor.pages.play import PlayPages
from benchmarks.monitor.pages.runs import RunPages
from benchmarks.monitor.pages.static import StaticPages
from benchmarks.monitor.pages.training import TrainingPages
from benchmarks.monitor.site import NotFound, Site

if TYPE_CHECKING:
    from benchmarks.vlm_run import VLMRun

_LOOPBACK = frozenset({"127.0.0.1", "localhost", "[::1]"})
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; style-src 'self'; script-src 'self'; "
    "img-src 'self' data:; connect-src 'self'; form-action 'self'; base-uri 'none'; "
    "frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "same-origin",
    "Cache-Control": "no-store",
}
_TOKEN = "er-gym-token"
_READER = "er-gym-reads-runs"


def make_app(
    roots: Sequence[Path],
    token: str = "",
    closing: threading.Event | None = None,
    *,
    play: Path | None = None,
    vlm_run: Callable[[str], VLMRun] | None = None,
) -> FastAPI:
    """The application.

    Args:
        roots: the directories that it may read.
        token: must be given once as ``?token=``; "" where only this machine can connect. Then
            requests must name this machine as their host, as a protection against DNS rebinding.
        closing: set when the server is to end, so that no more runs are read beforehand.
        play: the directory for the runs that a person plays; None if nobody may play.
        vlm_run: the run of a vision-language agent that a person watches, by its name; None for
            one without any options.
    """
    site = Site(Directories(roots if play is None else (*roots, play)))
    closing = closing or threading.Event()
    playing = PlayPages(site, play, vlm_run)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        # Nobody waits for this thread, so that Ctrl-C need not.
        threading.Thread(target=site.read_runs, args=(closing,), name=_READER, daemon=True).start()
        yield
        await run_in_threadpool(playing.sessions.close)

    app = FastAPI(
        title="er-gym", docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan
    )

    @app.middleware("http")
    async def guard(request: Request, call_next: RequestResponseEndpoint) -> Response:
        response = _refusal(request, token) or await call_next(request)
        for name, value in _HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    @app.exception_handler(NotFound)
    @app.exception_handler(404)
    async def gone(request: Request, error: Exception) -> Response:
        said = error if isinstance(error, NotFound) else NotFound()
        told = {"key": said.key, "back": said.back}
        return await run_in_threadpool(site.show, request, "gone.html", told, 404)

    every = (
        RunPages(site), EpisodePages(site), ComparePages(site), TrainingPages(site),
        DataPages(site), LivePages(site), StaticPages(),
    )  # fmt: skip
    for pages in every:
        for path, page in pages.routes().items():
            app.add_api_route(path, page, methods=["GET"], response_class=HTMLResponse)
    NotingPages(site).add_to(app)
    playing.add_to(app)
    return app


def _refusal(request: Request, token: str) -> Response | None:
    """The answer to a request that must not be answered otherwise."""
    if not token:
        host = request.headers.get("host", "")
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        return None if name in _LOOPBACK else PlainTextResponse("ask for 127.0.0.1\n", 403)
    given = request.query_params.get("token", "")
    if given and hmac.compare_digest(given.encode(), token.encode()):
        left = [(key, value) for key, value in request.query_params.multi_items() if key != "token"]
        query = f"?{urlencode(left)}" if left else ""
        answer = RedirectResponse(f"{request.url.path}{query}", 303)
        # Not "strict": then a browser would withhold it where a link of another site led here, from
        # this redirection on. With "lax" such a link may show a page, as the token in it may; no
        # other site's form, frame, picture or script is sent it.
        answer.set_cookie(_TOKEN, token, httponly=True, samesite="lax")
        return answer
    known = request.cookies.get(_TOKEN, "")
    if hmac.compare_digest(known.encode(), token.encode()):
        return None
    return PlainTextResponse(
        "this address needs the token that er-gym ui printed: add ?token=…\n", 403
    )
