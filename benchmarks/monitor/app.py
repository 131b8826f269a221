"""The monitor's pages as a FastAPI application."""

from __future__ import annotations

import asyncio
import hmac
import io
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse, RedirectResponse, StreamingResponse
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from PIL import Image
from starlette.concurrency import run_in_threadpool
from starlette.middleware.base import RequestResponseEndpoint

from benchmarks.monitor import formats, svg
from benchmarks.monitor.episode_view import MOST_TEXT, picture_file, view_of
from benchmarks.monitor.language import LANGUAGES, Translator, chosen_language
from benchmarks.monitor.places import Kind, Place, Places
from benchmarks.monitor.room_map import room_map
from benchmarks.monitor.run_view import Filter, RunSummary, RunViews
from benchmarks.monitor.world import CannotReplay, Worlds
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory

_STATIC = {
    "monitor.css": "text/css; charset=utf-8",
    "monitor.js": "text/javascript; charset=utf-8",
}
_PICTURES = {
    ".jpg": "image/jpeg",
    ".jpeg": "image/jpeg",
    ".png": "image/png",
    ".webp": "image/webp",
}
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
_LANGUAGE = "er-gym-language"
_LOOK_SECONDS = 0.7
"""How often a page's directories are looked at while a browser waits for news."""
_BEAT_SECONDS = 15.0
"""A line is sent at least so often, so that both sides notice a lost connection."""


class NothingThere(Exception):
    """There is nothing at this address."""


def make_app(roots: Sequence[Path], token: str = "") -> FastAPI:
    """The application.

    Args:
        roots: the directories that it may read.
        token: must be given once as ``?token=``; "" where only this machine can connect. Then
            requests must name this machine as their host, so that no foreign page can read along
            through a name that it made point here.
    """
    app = FastAPI(title="er-gym", docs_url=None, redoc_url=None, openapi_url=None)
    pages = _Pages(Places(roots))

    @app.middleware("http")
    async def guard(request: Request, call_next: RequestResponseEndpoint) -> Response:
        response = _refusal(request, token) or await call_next(request)
        for name, value in _HEADERS.items():
            response.headers.setdefault(name, value)
        return response

    @app.exception_handler(NothingThere)
    @app.exception_handler(404)
    async def gone(request: Request, error: Exception) -> Response:
        return await run_in_threadpool(pages.show, request, "gone.html", 404, {})

    for path, page in pages.routes().items():
        app.add_api_route(path, page, methods=["GET"], response_class=HTMLResponse)
    return app


def _refusal(request: Request, token: str) -> Response | None:
    """The answer to a request that must not be answered otherwise."""
    if not token:
        host = request.headers.get("host", "")
        name = host.rpartition(":")[0] if host.rpartition(":")[2].isdigit() else host
        return None if name in _LOOPBACK else Response("ask for 127.0.0.1\n", 403)
    given = request.query_params.get("token", "")
    if given and hmac.compare_digest(given.encode(), token.encode()):
        left = [(key, value) for key, value in request.query_params.multi_items() if key != "token"]
        query = f"?{urlencode(left)}" if left else ""
        answer = RedirectResponse(f"{request.url.path}{query}", 303)
        answer.set_cookie(_TOKEN, token, httponly=True, samesite="strict")
        return answer
    known = request.cookies.get(_TOKEN, "")
    if hmac.compare_digest(known.encode(), token.encode()):
        return None
    return Response("this address needs the token that er-gym ui printed: add ?token=…\n", 403)


class _Pages:
    """The pages and what they are made from."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._runs = RunViews()
        self._worlds = Worlds()
        self._templates = Environment(
            loader=PackageLoader("benchmarks.monitor", "templates"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self._templates.globals.update(svg=svg, query=urlencode, most_text=MOST_TEXT)
        self._templates.filters.update(formats.FILTERS)
        folder = files("benchmarks.monitor").joinpath("static")
        self._static = {name: folder.joinpath(name).read_bytes() for name in _STATIC}

    def routes(self) -> Mapping[str, Callable[..., Any]]:
        """The page of each address."""
        return {
            "/": self.home,
            "/runs/{id}": self.run,
            "/runs/{id}/episode": self.episode,
            "/runs/{id}/picture": self.picture,
            "/runs/{id}/map": self.map,
            "/runs/{id}/frame": self.frame,
            "/language/{name}": self.language,
            "/live": self.live,
            "/static/{name}": self.static,
        }

    # -- pages -----------------------------------------------------------------------------------

    def home(self, request: Request) -> Response:
        """All runs."""
        summaries = [self._summary(place) for place in self._places.of_kind("run")]
        summaries.sort(key=lambda each: (each.state != "playing", each.place.name))
        return self.show(
            request,
            "home.html",
            200,
            {"runs": summaries, "roots": self._places.roots, "live": "*"},
        )

    def run(self, request: Request, id: str) -> Response:
        """A run: its progress, its figures and its episodes."""
        place = self._place(id, "run")
        chosen = Filter.of(request.query_params)
        with self._runs.use(place) as view:
            groups, types = view.tallies()
            told = {
                "run": view.summary(),
                "filter": chosen,
                "page": view.page(chosen),
                "groups": groups,
                "types": types,
                "choices": view.choices(),
                "live": id,
            }
        return self.show(request, "run.html", 200, told)

    def episode(self, request: Request, id: str, key: str = "") -> Response:
        """An episode: its pictures, steps, thoughts and key actions."""
        place = self._place(id, "run")
        chosen = Filter.of(request.query_params)
        try:
            episode = view_of(RunDirectory.open(place.path), key)
        except (ValueError, OSError):
            raise NothingThere from None
        with self._runs.use(place) as view:
            before, after = view.neighbours(chosen, key)
            summary = view.summary()
        told = {
            "run": summary,
            "key": key,
            "episode": episode,
            "filter": chosen,
            "before": before,
            "after": after,
            "live": "",
        }
        return self.show(request, "episode.html", 200, told)

    def picture(self, id: str, key: str = "", n: int = 0) -> Response:
        """A picture that an agent was shown."""
        place = self._place(id, "run")
        try:
            pictures = view_of(RunDirectory.open(place.path), key).pictures
            file = picture_file(place.path, pictures[n]) if 0 <= n < len(pictures) else None
            kind = _PICTURES.get(file.suffix.lower()) if file else None
            if file is None or kind is None:
                raise NothingThere
            return Response(
                file.read_bytes(),
                media_type=kind,
                headers={"Cache-Control": "private, max-age=3600"},
            )
        except (ValueError, OSError):
            raise NothingThere from None

    def map(self, request: Request, id: str, key: str = "") -> Response:
        """The room of an episode from above, as SVG, or why it cannot be drawn."""
        record, manifest = self._record(id, key)
        words = self._translator(request)
        try:
            world = self._worlds.world(manifest, record)
        except CannotReplay as error:
            text = words("no_replay", why=formats.visible(str(error)))
            return HTMLResponse(Markup("<p class=empty>{}</p>").format(text))
        wanted = {key_action.object_id for key_action in record.key_actions}
        return HTMLResponse(room_map(world, wanted, words("map")))

    def frame(self, id: str, key: str = "", n: int = 0) -> Response:
        """What the agent could see after a step, drawn now."""
        record, manifest = self._record(id, key)
        if not 0 <= n < len(record.steps):
            raise NothingThere
        try:
            picture = self._worlds.frame(manifest, record, n)
        except CannotReplay:
            raise NothingThere from None
        data = io.BytesIO()
        Image.fromarray(picture).save(data, "JPEG", quality=85)
        return Response(
            data.getvalue(),
            media_type="image/jpeg",
            headers={"Cache-Control": "private, max-age=3600"},
        )

    def _record(self, id: str, key: str) -> tuple[EpisodeRecord, Manifest]:
        try:
            run = RunDirectory.open(self._place(id, "run").path)
            return run.episode(key), run.manifest
        except (ValueError, OSError):
            raise NothingThere from None

    # -- beside the pages ------------------------------------------------------------------------

    def language(self, request: Request, name: str) -> Response:
        """Choose a language, and go back."""
        if name not in LANGUAGES:
            raise NothingThere
        back = request.query_params.get("back", "/")
        answer = RedirectResponse(back if _is_here(back) else "/", 303)
        answer.set_cookie(_LANGUAGE, name, max_age=10**8, httponly=True, samesite="strict")
        return answer

    def static(self, name: str) -> Response:
        """A file that the pages need."""
        if name not in self._static:
            raise NothingThere
        return Response(self._static[name], media_type=_STATIC[name])

    async def live(self, request: Request, of: str = "*") -> Response:
        """News of a run, or of all: an event for each change."""
        return StreamingResponse(
            self._news(request, of[:200]),
            media_type="text/event-stream",
            headers={"X-Accel-Buffering": "no"},
        )

    async def _news(self, request: Request, of: str) -> AsyncIterator[str]:
        yield "retry: 1000\n\n"
        told, silent = await run_in_threadpool(self._version, of), 0.0
        while not await request.is_disconnected():
            await asyncio.sleep(_LOOK_SECONDS)
            now = await run_in_threadpool(self._version, of)
            silent += _LOOK_SECONDS
            if now != told:
                told, silent = now, 0.0
                yield "event: change\ndata: 1\n\n"
            elif silent >= _BEAT_SECONDS:
                silent = 0.0
                yield ": still here\n\n"

    def _version(self, of: str) -> object:
        """What changes whenever a run, or any of all runs, does."""
        places = [each for each in self._places.of_kind("run") if of in ("*", each.id)]
        versions = []
        for place in places:
            with self._runs.use(place) as view:
                summary = view.summary()
                versions.append((place.id, summary.version, summary.state))
        return tuple(versions)

    # -- helpers ---------------------------------------------------------------------------------

    def show(
        self, request: Request, template: str, status: int, told: Mapping[str, Any]
    ) -> Response:
        """A page in the reader's language."""
        here = request.url.path + (f"?{request.url.query}" if request.url.query else "")
        text = self._templates.get_template(template).render(
            {"live": "", **told, "t": self._translator(request), "here": here}
        )
        return HTMLResponse(text, status)

    def _translator(self, request: Request) -> Translator:
        accepted = request.headers.get("accept-language", "")
        return Translator(chosen_language(request.cookies.get(_LANGUAGE, ""), accepted))

    def _place(self, id: str, kind: Kind) -> Place:
        place = self._places.get(id)
        if place is None or place.kind != kind:
            raise NothingThere
        return place

    def _summary(self, place: Place) -> RunSummary:
        with self._runs.use(place) as view:
            return view.summary()


def _is_here(address: str) -> bool:
    """Whether an address is one of this server's: a path, and not of another host (``//host``)."""
    return (
        address.startswith("/") and not address.startswith(("//", "/\\")) and address.isprintable()
    )
