"""MCP: a server whose tools are the verbs, for any client of the Model Context Protocol.

``er-gym mcp`` runs it, on standard input and output for the program that starts it, or on a port.
A client begins an episode by the tool ``begin``, whose answer names it; the other tools take the
name. Nobody can guess the name of another's episode.
"""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import gymnasium
from mcp.server.mcpserver import MCPServer
from mcp.server.mcpserver.exceptions import ToolError
from mcp.server.mcpserver.utilities.types import Image
from mcp_types import CallToolResult, TextContent

from er_gym.integrations.session import Session, Turn, png
from er_gym.integrations.verb_tools import VerbTool, verb_tools
from er_gym.version import __version__

MAX_EPISODES = 64
IDLE_SECONDS = 600.0
META = "er-gym/turn"
"""The entry of a result's ``_meta`` that has the turn's reward, end, success and more. Programs
read it; clients do not show it to a model."""


@dataclass
class _Episode:
    session: Session
    lock: threading.Lock = field(default_factory=threading.Lock)
    used: float = field(default_factory=time.monotonic)


class Episodes:
    """The episodes under way, by name.

    Args:
        most: at a time.
        idle_seconds: after so long without a call an episode is closed when another one begins.
        settings: of :class:`~er_gym.integrations.session.Session`.
    """

    def __init__(
        self, most: int = MAX_EPISODES, idle_seconds: float = IDLE_SECONDS, **settings: Any
    ) -> None:
        Session(**settings).close()  # refuses now what it would refuse at the first episode
        self._most, self._idle, self._settings = most, idle_seconds, settings
        self._lock = threading.Lock()
        self._episodes: dict[str, _Episode] = {}

    def begin(self, seed: int | None, task_id: str, scene: str) -> tuple[str, Turn]:
        """Begin an episode; returns its name."""
        self._free()
        session = Session(**self._settings)
        try:
            turn = session.reset(task_id or None, seed=seed, scene=scene or None)
        except Exception:  # whatever it is goes on to the client; the simulator must not stay
            session.close()
            raise
        name = secrets.token_urlsafe(9)
        with self._lock:
            self._episodes[name] = _Episode(session)
        return name, turn

    def step(self, name: str, text: str) -> Turn:
        """Do what a text says, in an episode."""
        with self._lock:
            episode = self._episodes.get(name)
        if episode is None:
            raise ToolError(
                f"there is no episode {name!r:.80}; give the name that the tool begin has answered"
            )
        with episode.lock:
            episode.used = time.monotonic()
            turn = episode.session.step(text)
            if turn.done:
                self._close(name)
            return turn

    def close(self) -> None:
        """Close all episodes."""
        for name in list(self._episodes):
            self._close(name)

    def __len__(self) -> int:
        return len(self._episodes)

    def _free(self) -> None:
        """Close the idle; ToolError if there is no room then."""
        now = time.monotonic()
        with self._lock:
            idle = [n for n, each in self._episodes.items() if now - each.used > self._idle]
        for name in idle:
            self._close(name)
        if len(self._episodes) >= self._most:
            raise ToolError(f"{self._most} episodes are under way, as many as may be; try later")

    def _close(self, name: str) -> None:
        with self._lock:
            episode = self._episodes.pop(name, None)
        if episode is not None:
            episode.session.close()


def make_server(episodes: Episodes | None = None, **settings: Any) -> MCPServer[Any]:
    """The server.

    Args:
        episodes: what it plays in; by default new ones.
        settings: of :class:`Episodes`, if none are given.
    """
    plays = Episodes(**settings) if episodes is None else episodes
    server: MCPServer[Any] = MCPServer(
        "er-gym", version=__version__, instructions=INSTRUCTIONS, log_level="ERROR"
    )

    def begin(seed: int | None = None, task_id: str = "", scene: str = "") -> CallToolResult:
        """Begin an episode, of the task of this id or of one that is drawn. A seed draws the same
        one each time; a scene, such as FloorPlan1, one in that room."""
        with _told_as_errors():
            name, turn = plays.begin(seed, task_id, scene)
        return _result(turn, f"Episode {name}. Give this name to the other tools.")

    def act(action: str, episode: str) -> CallToolResult:
        """Do the action that a text names, in an episode: 'navigate to Fridge'."""
        with _told_as_errors():
            return _result(plays.step(episode, action))

    server.add_tool(begin, structured_output=False)
    server.add_tool(act, structured_output=False)
    for tool in verb_tools():
        server.add_tool(
            _with_object(plays, tool) if tool.takes_object else _alone(plays, tool),
            name=tool.name,
            description=tool.about,
            structured_output=False,
        )
    return server


INSTRUCTIONS = (
    "Each tool but 'begin' is an action of an agent in a room of a house. Begin an episode, do its "
    "task by one action at a time, and call 'end' when it is done. Objects are named by their "
    "type, such as Fridge or CounterTop."
)


def _alone(plays: Episodes, tool: VerbTool) -> Callable[..., CallToolResult]:
    def act(episode: str) -> CallToolResult:
        with _told_as_errors():
            return _result(plays.step(episode, tool.action()))

    return act


def _with_object(plays: Episodes, tool: VerbTool) -> Callable[..., CallToolResult]:
    def act(object: str, episode: str) -> CallToolResult:
        with _told_as_errors():
            return _result(plays.step(episode, tool.action(object)))

    return act


@contextmanager
def _told_as_errors() -> Iterator[None]:
    """The SDK tells a client only the words of a ToolError."""
    try:
        yield
    except (ValueError, gymnasium.error.Error) as error:
        raise ToolError(str(error)) from error


def _result(turn: Turn, *words: str) -> CallToolResult:
    blocks: list[Any] = [TextContent(text=text) for text in (*words, turn.text)]
    if turn.done:
        done = "done" if turn.success else "not done"
        blocks.append(TextContent(text=f"The episode is over: the task is {done}."))
    if turn.picture is not None:
        blocks.append(Image(data=png(turn.picture), format="png").to_image_content())
    told = {name: value for name, value in vars(turn).items() if name not in ("text", "picture")}
    return CallToolResult(content=blocks, _meta={META: {**told, "done": turn.done}})
