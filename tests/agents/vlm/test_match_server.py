"""The match server, over a real socket, in its own process."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from agents.vlm.match_server import make_app
from agents.vlm.matching import Matcher
from agents.vlm.settings import Matching

pytest.importorskip("rapidfuzz", reason="needs RapidFuzz: pip install 'er-gym[vlm]'")

_SERVE = """
from agents.vlm.match_server import serve
from agents.vlm.matching import Matcher
from agents.vlm.settings import Matching
serve(Matcher(Matching()), 0)
"""


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    with subprocess.Popen(
        [sys.executable, "-c", _SERVE],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        cwd=Path(__file__).parents[3],
        text=True,
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().strip()
            process.send_signal(signal.SIGINT)
            assert process.wait(timeout=60) == 0
        finally:
            process.kill()


def ask(url: str, body: bytes | dict[str, Any] | None = None) -> tuple[int, Any]:
    data = json.dumps(body).encode() if isinstance(body, dict) else body
    request = urllib.request.Request(url, data, {"Content-Type": "application/json"})
    try:
        with urllib.request.urlopen(request, timeout=60) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def test_listens_on_this_machine_alone(url: str) -> None:
    assert url.startswith("http://127.0.0.1:")
    assert ask(f"{url}/health") == (200, {"status": "ok"})


def test_a_name(url: str) -> None:
    assert ask(f"{url}/match", {"name": "couch"}) == (
        200,
        {"name": "couch", "object_type": "Sofa", "how": "alias", "score": 1.0, "near": []},
    )


def test_a_name_of_none(url: str) -> None:
    status, match = ask(f"{url}/match", {"name": "spaceship"})
    assert status == 200
    assert (match["object_type"], match["how"], len(match["near"])) == ("", "none", 3)


def test_names_and_preferences(url: str) -> None:
    body = {"names": ["table", "Microwav", "冰箱"], "prefer": ["SideTable"]}
    status, answer = ask(f"{url}/match", body)
    assert status == 200
    found = [(each["object_type"], each["how"]) for each in answer["matches"]]
    assert found == [("SideTable", "alias"), ("Microwave", "fuzzy"), ("Fridge", "alias")]
    assert ask(f"{url}/match", {"names": []}) == (200, {"matches": []})


@pytest.mark.parametrize(
    ("body", "error"),
    [
        (b"{", "the body: Invalid JSON"),
        (b"\xff", "the body: Invalid JSON"),
        (b"[]", "the body: Input should be an object"),
        ({}, "the body: give either 'name', a string, or 'names', a list of strings"),
        ({"name": "a", "names": ["b"]}, "the body: give either 'name'"),
        ({"name": 5}, "name: Input should be a valid string"),
        ({"names": "a"}, "names: Input should be a valid array"),
        ({"names": [None]}, "names.0: Input should be a valid string"),
        ({"names": ["a"] * 1001}, "names: List should have at most 1000 items"),
        ({"name": "a", "prefers": []}, "prefers: Extra inputs are not permitted"),
    ],
)
def test_bad_requests(url: str, body: Any, error: str) -> None:
    status, answer = ask(f"{url}/match", body)
    assert status == 400
    assert answer["error"].startswith(error)
    assert "\n" not in answer["error"]


def test_other_refusals_are_json_too(url: str) -> None:
    assert ask(f"{url}/nowhere")[0] == 404
    status, answer = ask(f"{url}/match")
    assert status == 405
    assert answer["error"].startswith("Method Not Allowed")
    assert ask(f"{url}/match", b" " * (1 << 21))[0] == 413
    assert ask(f"{url}/health") == (200, {"status": "ok"})


def test_a_matcher_that_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sentence_transformers", None)  # type: ignore[arg-type]
    app = make_app(Matcher(Matching(embeddings="some/model")))
    answer = app.test_client().post("/match", json={"name": "spaceship"})
    assert answer.status_code == 500
    assert "'some/model' needs sentence-transformers" in answer.get_json()["error"]
