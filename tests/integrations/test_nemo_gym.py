"""NeMo Gym's Gymnasium server plays household tasks."""

from __future__ import annotations

from typing import Any
from unittest.mock import MagicMock

import pytest
from conformance import SETTINGS, Answer, Course, differences, reply

pytest.importorskip("nemo_gym", reason="needs NeMo Gym, and Python 3.12")
plug = pytest.importorskip("er_gym.integrations.nemo_gym")


def client_of(**session: Any) -> Any:
    from fastapi.testclient import TestClient
    from nemo_gym.server_utils import ServerClient

    config = plug.HouseholdConfig(
        host="", port=0, entrypoint="", name="er_gym", domain="agent", session=session
    )
    server = plug.HouseholdServer(config=config, server_client=MagicMock(spec=ServerClient))
    return TestClient(server.setup_webserver())


class OfNeMo:
    def __init__(self) -> None:
        self.client = client_of(**SETTINGS)

    def post(self, path: str, **body: Any) -> dict[str, Any]:
        answer = self.client.post(path, json={"responses_create_params": {"input": []}, **body})
        answer.raise_for_status()
        told: dict[str, Any] = answer.json()
        return told

    def reset(self, task_id: str) -> Answer:
        self.task = task_id
        told = self.post("/reset", task_id=task_id)
        assert told["info"]["task_id"] == task_id
        return Answer(told["observation"], 0.0, False, told["info"]["success"])

    def step(self, text: str) -> Answer:
        part = {"type": "output_text", "text": reply(text), "annotations": []}
        message = {
            "id": "m",
            "type": "message",
            "role": "assistant",
            "status": "completed",
            "content": [part],
        }
        response = {
            "id": "r",
            "created_at": 0.0,
            "model": "any",
            "object": "response",
            "output": [message],
            "parallel_tool_calls": False,
            "tool_choice": "auto",
            "tools": [],
        }
        told = self.post("/step", task_id=self.task, response=response)
        done = told["terminated"] or told["truncated"]
        return Answer(told["observation"], told["reward"], done, told["info"]["success"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfNeMo(), courses) == []
