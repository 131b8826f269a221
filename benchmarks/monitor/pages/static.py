"""Files that the pages need, and the choice of a language."""

from __future__ import annotations

from importlib.resources import files

from fastapi import Request, Response
from fastapi.responses import RedirectResponse

from benchmarks.monitor.language import LANGUAGES
from benchmarks.monitor.site import LANGUAGE, NotFound, Routes, is_here

_KINDS = {".css": "text/css; charset=utf-8", ".js": "text/javascript; charset=utf-8"}


class StaticPages:
    """See the file."""

    def __init__(self) -> None:
        folder = files("benchmarks.monitor").joinpath("static")
        self._files = {
            each.name: (each.read_bytes(), kind)
            for each in folder.iterdir()
            for suffix, kind in _KINDS.items()
            if each.name.endswith(suffix)
        }

    def routes(self) -> Routes:
        """The pages by address."""
        return {"/static/{name}": self.file, "/language/{name}": self.language}

    def file(self, name: str) -> Response:
        """A file that the pages need."""
        if name not in self._files:
            raise NotFound
        content, kind = self._files[name]
        return Response(content, media_type=kind)

    def language(self, request: Request, name: str) -> Response:
        """Choose a language, and go back."""
        if name not in LANGUAGES:
            raise NotFound
        back = request.query_params.get("back", "/")
        answer = RedirectResponse(back if is_here(back) else "/", 303)
        answer.set_cookie(LANGUAGE, name, max_age=10**8, httponly=True, samesite="lax")
        return answer
