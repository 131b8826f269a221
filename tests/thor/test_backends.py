"""``make_controller`` for either engine, and its errors when an engine is unavailable."""

from __future__ import annotations

import gc
import time
import warnings

import ai2thor.controller
import pytest

from er_gym.thor import BACKENDS, BackendError, make_controller


def test_embedded_is_the_default_and_an_official_controller():
    controller = make_controller(scene="FloorPlan2", headless=True)
    assert isinstance(controller, ai2thor.controller.Controller)
    assert controller.last_event.metadata["sceneName"] == "FloorPlan2_physics"
    controller.stop()


@pytest.mark.parametrize("name", ["Unity", "embeded", "", None])
def test_an_unknown_backend_is_told_those_there_are(name):
    with pytest.raises(ValueError, match="embedded, unity") as caught:
        make_controller(name)
    assert repr(name) in str(caught.value)


def test_backends_are_listed():
    assert list(BACKENDS) == ["embedded", "unity"]


@pytest.fixture
def no_unity(monkeypatch, tmp_path):
    """A machine without a display, a build and a network: the proxy that it names is not there."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    for name in ("NO_PROXY", "no_proxy"):
        monkeypatch.delenv(name, raising=False)
    for name in ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY"):
        monkeypatch.setenv(name, "http://127.0.0.1:9")
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # the client leaves its files open
        gc.collect()


def test_unity_that_cannot_be_had_says_so_in_one_line_and_soon(no_unity):
    start = time.monotonic()
    with pytest.raises(BackendError) as caught:
        make_controller("unity", scene="FloorPlan1")
    assert time.monotonic() - start < 20
    message = str(caught.value)
    assert "\n" not in message
    assert "backend='embedded'" in message  # what to do instead
    assert "network" in message  # what it lacks


def test_unity_from_a_path_that_is_not_there_says_so(no_unity, tmp_path):
    missing = tmp_path / "player"
    with pytest.raises(BackendError) as caught:
        make_controller("unity", local_executable_path=str(missing), x_display=":0")
    assert str(missing) in str(caught.value)
    assert "\n" not in str(caught.value)
