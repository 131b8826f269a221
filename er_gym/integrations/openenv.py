"""OpenEnv: a server on which each connection plays in an environment of its own.

``er-gym openenv`` runs it. Clients of OpenEnv connect to ``ws://HOST:PORT/ws``; :class:`EREnv` is
one that returns typed observations. A session ends with its connection, or after some time without
a message. ``POST /reset`` and ``/step`` keep no session, and are of use as a check only.
"""

from __future__ import annotations

import base64
import json
import os
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse
from openenv.core import EnvClient
from openenv.core.client_types import StepResult
from openenv.core.env_server import Action, Environment, Observation, State, create_fastapi_app
from openenv.core.env_server.types import ConcurrencyConfig, EnvironmentMetadata
from pydantic import Field

from er_gym.envs.errors import ResetNeeded
from er_gym.integrations.session import Session, Turn, png
from er_gym.tasks.config_folder import config_directory
from er_gym.version import __version__
from er_gym.writing.folders import whole_folder

MAX_SESSIONS = 64
IDLE_SECONDS = 600.0
SETTINGS = "ER_GYM_OPENENV"
"""The environment variable with the arguments of :func:`make_app` as JSON, for more processes than
one: each of them makes an app of its own (:func:`app_of_variable`)."""
_LONGEST = 10_000


class ERAction(Action):
    """An action, as text: ``navigate to Fridge``."""

    text: str = Field(max_length=_LONGEST, description="such as 'navigate to Fridge' or 'end'")


class ERObservation(Observation):
    """A :class:`~er_gym.integrations.session.Turn`; its reward is OpenEnv's own field."""

    text: str
    picture: str | None = Field(None, description="the agent's view, a PNG file in base64")
    terminated: bool
    truncated: bool
    success: bool
    is_action_valid: bool
    anchor: str
    progress: float
    task_id: str
    instruction: str
    steps: int
    max_steps: int
    end_reason: str


class EREnvironment(Environment[ERAction, ERObservation, State]):
    """A session, as OpenEnv's server plays it.

    Args:
        settings: of :class:`~er_gym.integrations.session.Session`.
    """

    SUPPORTS_CONCURRENT_SESSIONS = True

    def __init__(self, **settings: Any) -> None:
        super().__init__()
        self._session = Session(**settings)
        self._state = State()

    def reset(
        self,
        seed: int | None = None,
        episode_id: str | None = None,
        task: str | None = None,
        scene: str | None = None,
        **unknown: Any,
    ) -> ERObservation:
        """Begin an episode, of the task of this id or of one that is drawn, in this room if given.

        Raises:
            ValueError: there is no such task or scene, or an argument is unknown.
        """
        if unknown:
            raise ValueError(
                f"unknown argument {min(unknown)!r:.80} of reset; there are: seed, episode_id, "
                "task, scene"
            )
        observation = _told(self._session.reset(task, seed=seed, scene=scene))
        self._state = State(episode_id=episode_id, **_of_episode(observation))
        return observation

    def step(
        self, action: ERAction, timeout_s: float | None = None, **unknown: Any
    ) -> ERObservation:
        """Do what the action's text says."""
        observation = _told(self._session.step(action.text))
        self._state = State(episode_id=self._state.episode_id, **_of_episode(observation))
        return observation

    @property
    def state(self) -> State:
        """The episode's id, task and steps."""
        return self._state

    def get_metadata(self) -> EnvironmentMetadata:
        """What the server says that it is."""
        return EnvironmentMetadata(
            name="er_gym",
            description="Household tasks in AI2-THOR rooms, played by texts of actions",
            version=__version__,
        )

    def close(self) -> None:
        """Stop the simulator."""
        self._session.close()


def _told(turn: Turn) -> ERObservation:
    own = {name: getattr(turn, name) for name in ERObservation.model_fields if hasattr(turn, name)}
    picture = None if turn.picture is None else base64.b64encode(png(turn.picture)).decode()
    return ERObservation(**{**own, "picture": picture})


def _of_episode(observation: ERObservation) -> dict[str, Any]:
    return {"step_count": observation.steps, "task_id": observation.task_id}


class EREnv(EnvClient[ERAction, ERObservation, State]):
    """A client: ``with EREnv("http://127.0.0.1:8000").sync() as env: env.reset(task="…")``."""

    def _step_payload(self, action: ERAction) -> dict[str, Any]:
        return {"text": action.text}

    def _parse_result(self, payload: dict[str, Any]) -> StepResult[ERObservation]:
        reward, done = payload["reward"], payload["done"]
        observation = ERObservation(**payload["observation"], reward=reward, done=done)
        return StepResult(observation=observation, reward=reward, done=done)

    def _parse_state(self, payload: dict[str, Any]) -> State:
        return State(**payload)


def make_app(
    max_sessions: int = MAX_SESSIONS, idle_seconds: float = IDLE_SECONDS, **settings: Any
) -> FastAPI:
    """The server.

    Args:
        max_sessions: connections at a time; the next one is told that the server is full.
        idle_seconds: without a message for so long, a session's environment is closed.
        settings: of :class:`~er_gym.integrations.session.Session`, the same for all sessions.

    Raises:
        ValueError: a setting is out of its range.
    """
    Session(**settings).close()  # refuses now what it would refuse at the first connection
    app: FastAPI = create_fastapi_app(
        partial(EREnvironment, **settings),
        ERAction,
        ERObservation,
        concurrency_config=ConcurrencyConfig(
            max_concurrent_envs=max_sessions, session_timeout=idle_seconds
        ),
    )
    for kind, status in ((ResetNeeded, 409), (ValueError, 422), (gymnasium.error.Error, 422)):
        app.add_exception_handler(kind, partial(_refused, status))
    return app


async def _refused(status: int, request: Request, error: Exception) -> JSONResponse:
    hint = "; a session lives in a connection to /ws" if isinstance(error, ResetNeeded) else ""
    return JSONResponse({"detail": f"{error}{hint}"}, status)


def app_of_variable() -> FastAPI:
    """The server of the arguments in :data:`SETTINGS`."""
    return make_app(**json.loads(os.environ.get(SETTINGS, "{}")))


def write_hub_folder(path: Path) -> None:
    """Write the folder from which OpenEnv's hub builds a server: manifest, Dockerfile, server.

    Raises:
        ForeignFile, CannotWrite: something else is there, or it cannot be written.
    """
    with whole_folder(path) as draft:
        shutil.copytree(
            config_directory("openenv"),
            draft,
            dirs_exist_ok=True,
            ignore=shutil.ignore_patterns("__pycache__"),
        )
