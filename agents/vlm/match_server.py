"""Name matching over HTTP, for programs in other languages. It listens on this machine only.

::

    POST /match   {"name": "couch"}                                  a match
    POST /match   {"names": ["couch", "table"], "prefer": ["Desk"]}  {"matches": [a match, …]}
    GET  /health                                                     {"status": "ok"}

A match is ``{"name", "object_type", "how", "score", "near"}``, as
:class:`~agents.vlm.matching.Match` has them. A failed request is
answered with ``{"error": …}`` in one line and a status of 4xx or 5xx.
"""

from __future__ import annotations

import socket
from dataclasses import asdict
from typing import Annotated

from flask import Flask, jsonify, request
from flask.typing import ResponseReturnValue
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from werkzeug.exceptions import HTTPException
from werkzeug.serving import make_server

from agents.vlm.matching import Matcher
from er_gym.tasks.errors import first_problem

HOST = "127.0.0.1"
_LARGEST_BODY = 1 << 20  # bytes
_MOST_NAMES = 1_000

_Names = Annotated[list[str], Field(max_length=_MOST_NAMES)]


class MatchRequest(BaseModel):
    """One name or several names to match; see :meth:`~agents.vlm.matching.Matcher.match_many`."""

    model_config = ConfigDict(extra="forbid", strict=True)

    name: str | None = None
    names: _Names | None = None
    prefer: _Names = []

    @model_validator(mode="after")
    def _one_of_both(self) -> MatchRequest:
        if (self.name is None) == (self.names is None):
            raise ValueError("give either 'name', a string, or 'names', a list of strings")
        return self


def make_app(matcher: Matcher) -> Flask:
    """The Flask application."""
    app = Flask(__name__)
    app.config["MAX_CONTENT_LENGTH"] = _LARGEST_BODY

    @app.get("/health")
    def health() -> ResponseReturnValue:
        return jsonify(status="ok")

    @app.post("/match")
    def match() -> ResponseReturnValue:
        try:
            asked = MatchRequest.model_validate_json(request.get_data())
        except ValidationError as error:
            return jsonify(error=first_problem(error, "the body")), 400
        names = asked.names if asked.name is None else [asked.name]
        matches = [asdict(each) for each in matcher.match_many(names or [], asked.prefer)]
        return jsonify(matches[0] if asked.name is not None else {"matches": matches})

    @app.errorhandler(HTTPException)
    def refused(error: HTTPException) -> ResponseReturnValue:
        return jsonify(error=f"{error.name}: {error.description}"), error.code or 500

    @app.errorhandler(ValueError)
    def failed(error: ValueError) -> ResponseReturnValue:
        return jsonify(error=str(error)), 500

    return app


def serve(matcher: Matcher, port: int) -> None:
    """Answer requests until interrupted. The first line of output is the address.

    Args:
        matcher: matches the names; its model is loaded before the first request.
        port: of this machine; 0 for any free port.

    Raises:
        ValueError: the matcher's model cannot be loaded, or the port is taken.
    """
    matcher.prepare()
    app = make_app(matcher)
    with (
        socket.socket() as listening
    ):  # our own socket: werkzeug ends the process if the port is taken
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind((HOST, port))
            listening.listen()
        except OSError as error:
            raise ValueError(
                f"port {port} of {HOST} cannot be used ({error.strerror}); choose another --port, "
                "or 0 for a free one"
            ) from error
        server = make_server(HOST, port, app, threaded=True, fd=listening.fileno())
        print(f"http://{HOST}:{listening.getsockname()[1]}", flush=True)
        server.serve_forever()
