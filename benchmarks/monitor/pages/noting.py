"""What people note: a flag and a text of an episode, and the tags of a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse, PlainTextResponse, RedirectResponse
from starlette.concurrency import run_in_threadpool

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.forms import BadForm
from benchmarks.monitor.notes import MOST_TEXT, CannotNote, Note, note_episode, tag_run
from benchmarks.monitor.site import NotFound, Routes, Site, is_here


class NotingPages:
    """See the file."""

    def __init__(self, site: Site) -> None:
        self._site = site

    def add_to(self, app: FastAPI) -> None:
        """Add the addresses to an application."""
        posts: Routes = {"/runs/{id}/note": self.note, "/runs/{id}/tags": self.tags}
        for path, page in posts.items():
            app.add_api_route(path, page, methods=["POST"], response_class=HTMLResponse)

    async def note(self, request: Request, id: str) -> Response:
        """Note something of an episode."""
        return await self._do(request, id, self._note)

    async def tags(self, request: Request, id: str) -> Response:
        """Give a run its tags."""
        return await self._do(request, id, self._tags)

    async def _do(
        self,
        request: Request,
        id: str,
        change: Callable[[Directory, Mapping[str, str]], None],
    ) -> Response:
        try:
            form = await self._site.forms.read(request)
        except BadForm as error:
            return PlainTextResponse(f"{error}\n", error.status)
        directory = self._site.directory(id, "run")
        try:
            await run_in_threadpool(change, directory, form)
        except CannotNote as error:
            return PlainTextResponse(f"{error}\n", 409)
        back = form.get("back", "")
        return RedirectResponse(back if is_here(back) else f"/runs/{id}", 303)

    def _note(self, directory: Directory, form: Mapping[str, str]) -> None:
        key = form.get("key", "")
        if key not in self._site.rows(directory):
            raise NotFound
        text = form.get("text", "").replace("\r\n", "\n").strip()
        if len(text) > MOST_TEXT:
            raise CannotNote(f"a note has at most {MOST_TEXT:,} characters")
        note_episode(directory.path, key, Note(flag=form.get("flag") == "on", text=text))

    def _tags(self, directory: Directory, form: Mapping[str, str]) -> None:
        tag_run(directory.path, form.get("tags", ""))
