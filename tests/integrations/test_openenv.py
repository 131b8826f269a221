"""The OpenEnv server, asked by OpenEnv's own clients over sockets."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from conformance import SETTINGS, Answer, Course, differences

pytest.importorskip("openenv.core", reason="openenv-core is not installed")

import uvicorn
import yaml
from openenv.cli._validation import validate_multi_mode_deployment
from openenv.core import GenericEnvClient
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from er_gym.integrations import openenv
from er_gym.integrations.openenv import ERAction, EREnv, make_app

TASK = "FloorPlan2-single_pickup_from_closerep-Lettuce"
OTHER = "FloorPlan2-710812-single_search-Apple"


class Server:
    """A server in a thread of this process, on a free port."""

    def __init__(self, **settings: Any) -> None:
        self.app = make_app(**{**SETTINGS, **settings})
        self.server = uvicorn.Server(uvicorn.Config(self.app, port=0, log_level="error"))
        self.thread = threading.Thread(target=self.server.run, daemon=True)
        self.thread.start()
        until(lambda: self.server.started)
        (port,) = {each.getsockname()[1] for each in self.server.servers[0].sockets}
        self.place = f"127.0.0.1:{port}"

    def client(self) -> Any:
        return EREnv(f"http://{self.place}").sync()

    def post(self, path: str, body: bytes) -> tuple[int, str]:
        request = Request(f"http://{self.place}{path}", body, {"content-type": "application/json"})
        try:
            with urlopen(request) as answer:
                return answer.status, answer.read().decode()
        except HTTPError as error:
            return error.code, error.read().decode()

    def close(self) -> None:
        self.server.should_exit = True
        self.thread.join()


def until(holds: Any, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come about"
        time.sleep(0.01)


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> set[int]:
    """The sessions whose environment is not closed."""
    there: set[int] = set()

    class Counted(openenv.Session):
        def reset(self, *arguments: Any, **more: Any) -> Any:
            turn = super().reset(*arguments, **more)
            there.add(id(self))
            return turn

        def close(self) -> None:
            there.discard(id(self))
            super().close()

    monkeypatch.setattr(openenv, "Session", Counted)
    return there


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    made = Server()
    yield made
    made.close()


class OfClient:
    def __init__(self, client: Any) -> None:
        self.client = client

    def reset(self, task_id: str) -> Answer:
        return self._answer(self.client.reset(task=task_id))

    def step(self, text: str) -> Answer:
        return self._answer(self.client.step(ERAction(text=text)))

    def _answer(self, result: Any) -> Answer:
        told = result.observation
        return Answer(told.text, result.reward, result.done, told.success)


def test_it_answers_as_gymnasium_make(server: Server, courses: tuple[Course, ...]) -> None:
    with server.client() as client:
        assert differences(OfClient(client), courses) == []


def test_a_client_that_knows_nothing_of_er_gym_plays_as_well(server: Server) -> None:
    with GenericEnvClient(f"http://{server.place}").sync() as client:
        client.reset(task=TASK, episode_id="mine")
        result = client.step({"text": "navigate to Fridge"})
        assert (result.reward, result.done) == (1.0, False)
        assert result.observation["is_action_valid"]
        state = client.state()
        assert (state["episode_id"], state["task_id"], state["step_count"]) == ("mine", TASK, 2)


def test_no_session_sees_anothers(server: Server) -> None:
    with server.client() as one, server.client() as two:
        one.reset(task=TASK)
        two.reset(task=OTHER)
        one.step(ERAction(text="navigate to Fridge"))
        two.step(ERAction(text="navigate to Sink"))
        assert (one.state().task_id, two.state().task_id) == (TASK, OTHER)
        told = one.step(ERAction(text="open Fridge")).observation
        assert (told.task_id, told.steps) == (TASK, 3)
        assert two.step(ERAction(text="observe")).observation.steps == 3


def test_a_full_server_says_so_and_has_room_again() -> None:
    server = Server(max_sessions=1)

    def told() -> dict[str, Any]:
        with connect(f"ws://{server.place}/ws") as socket:
            with suppress(ConnectionClosed):  # a full server does not wait for it
                socket.send(json.dumps({"type": "reset", "data": {"task": TASK}}))
            return dict(json.loads(socket.recv()))

    with server.client() as first:
        first.reset(task=TASK)
        refused = told()["data"]
        assert (refused["code"], refused["max_sessions"]) == ("CAPACITY_REACHED", 1)
    until(lambda: told()["type"] == "observation")
    server.close()


def test_what_is_abandoned_is_freed(opened: set[int]) -> None:
    """A connection that breaks, and one that says nothing for long."""
    server = Server(idle_seconds=0.05)
    begin = json.dumps({"type": "reset", "data": {"task": TASK}})
    with connect(f"ws://{server.place}/ws") as broken:
        broken.send(begin)
        broken.recv()
        assert len(opened) == 1
        broken.socket.close()  # no goodbye
    until(lambda: not opened)
    with connect(f"ws://{server.place}/ws") as silent:
        silent.send(begin)
        silent.recv()
        assert len(opened) == 1
        until(lambda: not opened)  # OpenEnv looks every five seconds
        silent.send(begin)
        assert "the session is closed" in silent.recv()
        assert opened == set()
    server.close()


@pytest.mark.parametrize(
    ("message", "words"),
    [
        ("{", "Invalid JSON"),
        ({"type": "fly"}, "Unknown message type: fly"),
        ({"type": "step", "data": {"text": "observe"}}, "no episode has begun"),
        ({"type": "step", "data": {}}, "Field required"),
        ({"type": "step", "data": {"text": 7}}, "valid string"),
        ({"type": "step", "data": {"text": "x" * 10_001}}, "at most 10000 characters"),
        ({"type": "step", "data": {"text": "end", "more": 1}}, "Extra inputs"),
        ({"type": "reset", "data": {"task": "none such"}}, "no task 'none such'"),
        ({"type": "reset", "data": {"task": {"id": 1}}}, "give a Task or its id"),
        ({"type": "reset", "data": {"scene": "FloorPlan999"}}, "FloorPlan999"),
        ({"type": "reset", "data": {"seed": "x"}}, "must be a python integer"),
        ({"type": "reset", "data": {"suite": "/etc/passwd"}}, "unknown argument 'suite'"),
    ],
)
def test_bad_messages_are_answered_in_words(server: Server, message: Any, words: str) -> None:
    with connect(f"ws://{server.place}/ws") as socket:
        socket.send(message if isinstance(message, str) else json.dumps(message))
        answer = json.loads(socket.recv())
        assert answer["type"] == "error"
        assert words in json.dumps(answer["data"])
        socket.send(json.dumps({"type": "reset", "data": {"task": TASK}}))  # it goes on
        assert json.loads(socket.recv())["type"] == "observation"


@pytest.mark.parametrize(
    ("path", "body", "status", "words"),
    [
        ("/reset", {"task": TASK}, 200, "Lettuce"),
        ("/reset", {"task": "none such"}, 422, "no task 'none such'"),
        ("/reset", {"seed": -1}, 422, "greater than or equal to 0"),
        ("/reset", {"suite": "/etc/passwd"}, 422, "unknown argument 'suite'"),
        ("/step", {"action": {"text": "observe"}}, 409, "lives in a connection to /ws"),
        ("/step", {"action": {}}, 422, "Field required"),
        ("/step", {}, 422, "Field required"),
    ],
)
def test_bad_requests_are_refused_in_words(
    server: Server, path: str, body: dict[str, Any], status: int, words: str
) -> None:
    code, told = server.post(path, json.dumps(body).encode())
    assert (code, words in told) == (status, True), told


def test_pictures_come_as_png() -> None:
    environment = openenv.EREnvironment(scaffold="picture", width=32, height=24, **SETTINGS)
    told = environment.reset(task=TASK)
    assert told.picture is not None
    assert told.picture.startswith("iVBORw0K")
    assert "You see" not in told.text
    environment.close()


def test_a_setting_that_nobody_can_play_with_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="unknown scaffold"):
        make_app(scaffold="everything")


def test_the_app_of_other_processes_has_the_same_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(openenv.SETTINGS, json.dumps({"scaffold": "everything"}))
    with pytest.raises(ValueError, match="unknown scaffold 'everything'"):
        openenv.app_of_variable()
    monkeypatch.delenv(openenv.SETTINGS)
    assert "/ws" in {getattr(route, "path", "") for route in openenv.app_of_variable().routes}


def test_the_folder_for_the_hub_is_one(tmp_path: Path) -> None:
    openenv.write_hub_folder(tmp_path / "space")
    _, issues = validate_multi_mode_deployment(tmp_path / "space")
    assert issues == ["Missing uv.lock - run 'uv lock' to generate it"]
    told = yaml.safe_load((tmp_path / "space" / "openenv.yaml").read_text())
    assert (told["app"], told["port"]) == ("server.app:app", 8000)
    with pytest.raises(ValueError, match="space"):
        openenv.write_hub_folder(tmp_path / "space")
