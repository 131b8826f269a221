"""Typed calls of the engine do what the client's requests do, and leave no event behind."""

from __future__ import annotations

import json
from typing import Any

import pytest

from er_gym.sim.controller import EmbeddedController
from er_gym.thor.calls import calls_of, seen_in

FRIDGE = "Fridge|-02.10|+00.00|+01.07"
CALLS: list[tuple[str, dict[str, Any]]] = [
    ("teleport", {"position": (-1.0, 0.901, 1.0), "rotation": 270, "horizon": 30.0}),
    ("act", {"action": "OpenObject", "objectId": FRIDGE}),
    ("teleport", {"position": (50.0, 0.9, 0.0), "rotation": 0.0, "horizon": 0.0}),
    ("teleport", {"position": (-1.0, 5.0, 1.0), "rotation": 0.0, "horizon": 0.0}),
    ("teleport", {"position": (-2.1, 0.901, 1.0), "rotation": -90.0, "horizon": 0.0}),
    ("teleport", {"position": (-1.0, 0.901, 1.0), "rotation": -90.0, "horizon": 75.0}),
    ("turn_right", {"degrees": 90.0}),
    ("move_ahead", {"metres": 0.1}),
    ("move_ahead", {"metres": 30.0}),
    ("act", {"action": "OpenObject", "objectId": "Fridge|nowhere"}),
]


def controller(headless: bool) -> EmbeddedController:
    return EmbeddedController(
        scene="FloorPlan1", gridSize=0.1, headless=headless, width=32, height=24
    )


def test_calls_do_what_requests_do() -> None:
    with controller(True) as quick, controller(False) as slow:
        results = []
        for name, arguments in CALLS:
            more = {"standing": True, "force": False} if name == "teleport" else {}
            told = [getattr(calls_of(c), name)(**arguments, **more) for c in (quick, slow)]
            assert told[0] == told[1]
            results.append(told[0][0])
            one, other = calls_of(quick).seen(), seen_in(slow.last_event)
            assert one[3:7] == other[3:7]
            assert one.visible.tolist() == other.visible.tolist()
            assert one.event is None
        assert results.count(True) == 4
        places = [(x / 4, 0.9, z / 4) for x in range(-8, 8) for z in range(-8, 10)]
        asked = (FRIDGE, places, (0, 90, 180, 270), (-30, 0, 30, 60))
        poses = calls_of(quick).poses(*asked)
        assert poses == calls_of(slow).poses(*asked)
        assert len(poses) > 20


def test_the_last_event_is_of_the_world_as_it_is_now() -> None:
    with controller(True) as quick:
        before = quick.last_event
        assert quick.direct is not None
        quick.direct.teleport((-1.0, 0.901, 1.0), 180.0, 0.0, True, False)
        assert before.metadata["agent"]["rotation"]["y"] == 270.0  # whoever kept it has the old
        assert quick.last_event is not before
        assert quick.last_event is quick.last_event
        assert quick.last_event.metadata["agent"]["rotation"]["y"] == 180.0
        text = json.dumps(quick.last_event.metadata["objects"])
        assert text == json.dumps(quick.step(action="Pass").metadata["objects"])


def test_an_invalid_call_raises_as_the_client_does() -> None:
    with controller(True) as quick:
        assert quick.direct is not None
        with pytest.raises(ValueError, match="Invalid action: Juggle"):
            quick.direct.act("Juggle")


def test_there_are_no_typed_calls_while_pictures_are_drawn() -> None:
    with controller(False) as drawing:
        assert drawing.direct is None
        assert calls_of(drawing).seen().event is drawing.last_event
