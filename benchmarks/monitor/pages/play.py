"""A person plays: what to play, and the episode in play."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, get_args
from urllib.parse import urlencode

from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse, PlainTextResponse, RedirectResponse
from starlette.concurrency import run_in_threadpool

from agents import AGENTS
from agents.zoo.index import PREFIX, model_names
from benchmarks.monitor.forms import BadForm, Forms
from benchmarks.monitor.language import Translator
from benchmarks.monitor.play.plan import plan, playable, run_path
from benchmarks.monitor.play.session import Order, Refused, Session, SessionState
from benchmarks.monitor.play.sessions import Sessions
from benchmarks.monitor.site import NotFound, Routes, Site
from er_gym.envs.actions import parse
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.suites import suite_names
from er_gym.tasks.task import Task

if TYPE_CHECKING:
    from benchmarks.vlm_run import VLMRun

KEYS: Mapping[str, str] = {
    verbs.NAVIGATE: "g",
    verbs.PICKUP: "p",
    verbs.PUT: "u",
    verbs.OPEN: "o",
    verbs.CLOSE: "c",
    verbs.TOGGLE: "t",
    verbs.SLICE: "s",
    verbs.OBSERVE: "l",
    verbs.MOVE_FORWARD: "f",
    verbs.END: "e",
}
"""The key that goes to the actions of a verb."""
_PATIENCE_SECONDS = 25.0
"""How long an answer waits for what was asked for; the page then shows how far it is."""
_ORDERS: frozenset[str] = frozenset(get_args(Order))
_FIRST = "mini"


class PlayPages:
    """See the file.

    Args:
        site: what all pages share.
        folder: holds the runs that a person plays; None if nobody may play.
        vlm_run: the run of a vision-language agent that a person watches; see :func:`plan`.
    """

    def __init__(
        self,
        site: Site,
        folder: Path | None,
        vlm_run: Callable[[str], VLMRun] | None = None,
    ) -> None:
        self._site, self._folder, self._vlm_run = site, folder, vlm_run
        self.sessions = Sessions()
        self._forms = Forms()

    def add_to(self, app: FastAPI) -> None:
        """Add the pages to an application."""
        gets: Routes = {
            "/play": self.choose,
            "/play/{id}": self.show,
            "/play/{id}/picture": self.picture,
            "/play/{id}/version": self.version,
        }
        for path, page in gets.items():
            app.add_api_route(path, page, methods=["GET"], response_class=HTMLResponse)
        posts: Routes = {"/play": self.begin, "/play/{id}": self.change}
        for path, page in posts.items():
            app.add_api_route(path, page, methods=["POST"], response_class=HTMLResponse)

    # -- choosing --------------------------------------------------------------------------------

    def choose(
        self, request: Request, suite: str = _FIRST, type: str = "", agent: str = ""
    ) -> Response:
        """The choice of what to play."""
        if self._folder is None:
            return self._site.show(request, "play.html", {"on": False, "problem": "", "at": "play"})
        return self._choice(request, {"suite": suite, "type": type, "agent": agent})

    def _choice(
        self, request: Request, given: Mapping[str, str], problem: str = "", status: int = 200
    ) -> Response:
        assert self._folder is not None
        suite, agent = given.get("suite", _FIRST), given.get("agent", "")
        tasks: list[tuple[Task, bool]] = []
        types: list[str] = []
        try:
            found, fitted = playable(suite)
            types = sorted({task.type.name for task in fitted.tasks})
            of_type = given.get("type", "")
            run = _run_in(run_path(self._folder, suite))
            tasks = [
                (task, run is not None and run.has(task.id))
                for task in fitted.tasks
                if of_type in ("", task.type.name)
            ]
            about = found.description
        except ValueError as error:
            problem, status, about = problem or str(error), max(status, 400), ""
        variables = {
            "on": True,
            "problem": problem,
            "secret": self._forms.secret,
            "suites": suite_names(),
            "suite": suite,
            "about": about,
            "types": types,
            "type": given.get("type", ""),
            "tasks": tasks,
            "agent": agent,
            "agents": (*AGENTS.names(), *(f"{PREFIX}{name}" for name in model_names())),
            "sessions": self.sessions.open_now(),
            "folder": self._folder,
        }
        return self._site.show(
            request, "play.html", variables | {"at": "play", "scripts": ("choose.js",)}, status
        )

    async def begin(self, request: Request) -> Response:
        """Begin a session."""
        if self._folder is None:
            return PlainTextResponse("nobody may play here: start er-gym ui --play FOLDER\n", 403)
        try:
            form = await self._forms.read(request)
        except BadForm as error:
            return PlainTextResponse(f"{error}\n", error.status)
        return await run_in_threadpool(self._begin, request, form)

    def _begin(self, request: Request, form: Mapping[str, str]) -> Response:
        assert self._folder is not None
        words = self._site.translator(request)
        if form.get("do") == "show":  # without JavaScript
            chosen = {name: form.get(name, "") for name in ("suite", "type", "agent")}
            return RedirectResponse(f"/play?{urlencode(chosen)}", 303)
        try:
            made = plan(
                self._folder,
                suite=form.get("suite", ""),
                type=form.get("type", ""),
                task=form.get("task", ""),
                agent=form.get("agent", "").strip(),
                vlm_run=self._vlm_run,
            )
            session = self.sessions.begin(made)
        except Refused as refused:
            problem = words(refused.key, **refused.values)
            return self._choice(request, form, problem, refused.status)
        except ValueError as error:
            return self._choice(request, form, str(error), 400)
        now = session.wait(_PATIENCE_SECONDS)
        if now.phase == "closed" and now.ended is None:
            return self._choice(request, form, now.why or words("play_all_played"), 409)
        return RedirectResponse(f"/play/{session.id}", 303)

    # -- playing ---------------------------------------------------------------------------------

    def show(self, request: Request, id: str) -> Response:
        """The episode in play."""
        session = self._session(id)
        return self._page(request, session, session.now)

    def _page(
        self,
        request: Request,
        session: Session,
        now: SessionState,
        problem: str = "",
        status: int = 200,
    ) -> Response:
        run = session.plan.path.resolve()
        variables = {
            "session": session,
            "plan": session.plan,
            "now": now,
            "turn": now.turn,
            "keys": KEYS,
            "words": verb_words(self._site.translator(request)),
            "problem": problem,
            "secret": self._forms.secret,
            "directory": self._site.directories.at(run, "run"),
            "at": "play",
            "scripts": ("play.js", "enlarge.js"),
        }
        return self._site.show(request, "play_session.html", variables, status)

    async def change(self, request: Request, id: str) -> Response:
        """Do what the person asks for, and show what came of it."""
        try:
            form = await self._forms.read(request)
        except BadForm as error:
            return PlainTextResponse(f"{error}\n", error.status)
        return await run_in_threadpool(self._change, request, self._session(id), form)

    def _change(self, request: Request, session: Session, form: Mapping[str, str]) -> Response:
        try:
            before = _asked(session, form, verb_words(self._site.translator(request)))
        except Refused as refused:
            problem = self._site.translator(request)(refused.key, **refused.values)
            return self._page(request, session, session.now, problem, refused.status)
        session.wait(_PATIENCE_SECONDS, before.version)
        return RedirectResponse(f"/play/{session.id}", 303)

    def picture(self, id: str, step: int = 0, n: int = 0) -> Response:
        """A picture of a turn of the episode in play."""
        pictures = self._session(id).now.shown.get(step, ())
        if not 0 <= n < len(pictures):
            raise NotFound
        picture = pictures[n]
        return Response(picture.data, media_type=picture.media_type)

    async def version(self, id: str) -> Response:
        """The version of a session."""
        return PlainTextResponse(str(self._session(id).now.version))

    def _session(self, id: str) -> Session:
        session = self.sessions.get(id)
        if session is None:
            raise NotFound("play_gone", "/play")
        return session


def _run_in(path: Path) -> RunDirectory | None:
    """The run in a directory; None if there is none."""
    try:
        return RunDirectory.open(path)
    except ValueError:
        return None


def verb_words(t: Translator) -> dict[str, str]:
    """What the pages call each verb."""
    named = {verb.name: f"do_{verb.name.replace(' ', '_')}" for verb in verbs.table()}
    return {verb: t.name(key) if t.name(key) != key else verb for verb, key in named.items()}


def _asked(session: Session, form: Mapping[str, str], words: Mapping[str, str]) -> SessionState:
    """Do what a form asks for; returns the state before.

    Args:
        session: of the person.
        form: the fields.
        words: what the page calls each verb.

    Raises:
        Refused: it cannot be done.
    """
    wanted = form.get("do", "")
    if wanted == "act":
        text, number = form.get("action", ""), form.get("step", "")
        turn = session.now.turn
        action = (turn.named(text, words) if turn else None) or parse(text)
        if action is None or not (number.isascii() and number.isdigit() and len(number) < 7):
            raise Refused("play_illegal", 422, action=text[:80])
        return session.decide(action, int(number))
    before = session.now
    if wanted == "pause":
        return session.pause()
    if wanted == "close":
        session.close()
        return before
    if wanted not in _ORDERS:
        raise Refused("play_unknown", 400)
    return session.order(wanted)  # type: ignore[arg-type]
