"""The player behind the official client: the same events as in process, and no trace afterwards."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import ai2thor.controller
import ai2thor.server
import numpy as np
import pytest
from ai2thor.fifo_server import FifoServer
from ai2thor.wsgi_server import WsgiServer

import er_gym
from er_gym.sim.controller import EmbeddedController
from er_gym.thor import launcher

PICTURES = ("frame", "depth_frame", "instance_segmentation_frame", "semantic_segmentation_frame")
THIRD_PARTY = (
    "third_party_camera_frames",
    "third_party_depth_frames",
    "third_party_instance_segmentation_frames",
    "third_party_semantic_segmentation_frames",
)
SMALL = {"width": 64, "height": 48}
LONG = 60.0
"""Seconds after which what a test waits for will not come."""
CORNER = {"position": {"x": 1.5, "y": 2.2, "z": -1.5}, "rotation": {"x": 30, "y": -45, "z": 5}}


@pytest.fixture(autouse=True)
def home(monkeypatch, tmp_path):
    """The client keeps logs and locks in the home folder; not in the user's."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    return tmp_path


def launch(**arguments):
    """An official controller with our player, told apart from ours by nothing."""
    given = {"scene": "FloorPlan1", "server_timeout": 30.0, **SMALL, **arguments}
    return ai2thor.controller.Controller(
        local_executable_path=er_gym.thor_executable(), x_display=":0", **given
    )


@pytest.fixture(params=[FifoServer, WsgiServer], ids=["FIFO", "WSGI"])
def server(request):
    """What the client speaks to the player with."""
    return {"server_class": request.param}


@pytest.fixture
def played():
    controller = launch()
    yield controller
    controller.stop()


def is_alive(pid: int) -> bool:
    """Whether a process runs; one that has ended and was not asked about does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


def ends(pid: int) -> bool:
    return comes(lambda: not is_alive(pid))


def comes(condition) -> bool:
    deadline = time.monotonic() + LONG
    while not condition() and time.monotonic() < deadline:
        time.sleep(0.02)
    return condition()


# -- the same events -------------------------------------------------------------------------------


def assert_same(one, other):
    """Two events say and show the same, to the last bit."""
    assert dict(one.metadata) == dict(other.metadata)
    for name in PICTURES:
        assert_same_picture(getattr(one, name), getattr(other, name))
    for name in THIRD_PARTY:
        ours, theirs = getattr(one, name), getattr(other, name)
        assert len(ours) == len(theirs)
        for mine, its in zip(ours, theirs, strict=True):
            assert_same_picture(mine, its)
    assert set(one.instance_masks) == set(other.instance_masks)


def assert_same_picture(mine, its):
    assert (mine is None) == (its is None)
    if mine is not None:
        assert mine.dtype == its.dtype
        np.testing.assert_array_equal(mine, its)


def do(controller, request):
    """The event, and the message of the error if that is how it went."""
    try:
        return controller.step(**request), None
    except ValueError as error:
        return controller.last_event, str(error)


def some_actions(seed: int, count: int, controller):
    """Requests of every sort, sensible ones and not."""
    chance = random.Random(seed)
    moves = ["MoveAhead", "MoveBack", "MoveLeft", "MoveRight", "RotateLeft", "RotateRight"]
    calls = [
        *({"action": name} for name in [*moves, "LookUp", "LookDown", "Crouch", "Stand", "Pass"]),
        {"action": "GetReachablePositions"},
        {"action": "DropHandObject"},
        {"action": "ThrowObject", "moveMagnitude": 120},
        {"action": "ChangeFOV", "fieldOfView": 75},
        {"action": "RotateRight", "degrees": float("nan")},
        {"action": "Fly"},
        {"action": "PickupObject"},
        {"action": "Pass", "renderDepthImage": True},
        {"action": "RotateLook", "rotation": 45, "horizon": 10, "speed": "unknown"},
        {"action": "PickupObject", "x": 0.5, "y": 0.7},
        {"action": "SliceObject", "x": 0.5, "y": 0.6, "forceAction": True},
        {"action": "Pass", "renderInstanceSegmentation": True},
        {"action": "RotateLeft", "degrees": 45, "renderSemanticSegmentation": True},
        {"action": "MoveAhead", "renderImage": False},
        {"action": "Pass", "renderImage": False},
        {"action": "InitialRandomSpawn", "randomSeed": 3},
        {"action": "UpdateThirdPartyCamera", "rotation": {"y": 20}},
    ]
    verbs = ["PickupObject", "OpenObject", "PutObject", "CloseObject", "ToggleObjectOn"]
    verbs += ["SliceObject", "BreakObject", "CookObject", "DirtyObject", "GetInteractablePoses"]
    for _ in range(count):
        if chance.random() < 0.5:
            ids = [entry["objectId"] for entry in controller.last_event.metadata["objects"]]
            request = {"action": chance.choice(verbs), "objectId": chance.choice(ids)}
            if request["action"] == "GetInteractablePoses":
                request["maxPoses"] = 3
            else:
                request["forceAction"] = chance.random() < 0.8
            yield request
        else:
            yield dict(chance.choice(calls))


def test_two_hundred_actions_give_the_same_events_as_in_process(server):
    settings = {**SMALL, "scene": "FloorPlan1"}
    with launch(**settings, **server) as played, EmbeddedController(**settings) as ours:
        assert_same(played.last_event, ours.last_event)
        for controller in (played, ours):
            controller.step("AddThirdPartyCamera", **CORNER)
        succeeded = 0
        for request in some_actions(seed=7, count=200, controller=ours):
            one, other = do(played, request), do(ours, request)
            assert one[1] == other[1], request
            assert_same(one[0], other[0])
            succeeded += one[0].metadata["lastActionSuccess"]
        assert 60 < succeeded < 140  # many of both
        assert_same(played.reset("FloorPlan402"), ours.reset("FloorPlan402"))


ALL_PICTURES = {
    "renderDepthImage": True,
    "renderInstanceSegmentation": True,
    "renderSemanticSegmentation": True,
}


def test_all_pictures_of_all_cameras_are_the_same(server):
    with (
        launch(**ALL_PICTURES, **server) as played,
        EmbeddedController(scene="FloorPlan1", **SMALL, **ALL_PICTURES) as ours,
    ):
        for controller in (played, ours):
            controller.step("AddThirdPartyCamera", **CORNER)
            controller.step("AddThirdPartyCamera", **CORNER, fieldOfView=40)
        for request in ({"action": "Pass"}, {"action": "RotateRight"}, {"action": "MoveBack"}):
            one, other = played.step(**request), ours.step(**request)
            assert_same(one, other)
            assert all(len(getattr(one, name)) == 2 for name in THIRD_PARTY)
            for mine, its in zip(
                one.third_party_instance_masks, other.third_party_instance_masks, strict=True
            ):
                assert set(mine) == set(its) != set()


def test_every_agents_event_is_the_same(server):
    settings = {**ALL_PICTURES, "agentCount": 3}
    with (
        launch(**settings, **server) as played,
        EmbeddedController(scene="FloorPlan1", **SMALL, **settings) as ours,
    ):
        requests = [
            {"action": "AddThirdPartyCamera", **CORNER},
            {"action": "RotateRight", "agentId": 1},
            {"action": "GetReachablePositions", "agentId": 2},
            {"action": "GetReachablePositions", "agentId": 2},
            {"action": "MoveAhead", "agentId": 2, "renderImage": False},
            {"action": "Fly", "agentId": 1},
            {"action": "Pass", "agentId": 7},
            {"action": "LookDown"},
        ]
        for request in requests:
            (one, said), (other, told) = do(played, request), do(ours, request)
            assert said == told, request
            assert len(one.events) == len(other.events) == 3
            assert one.metadata["agentId"] == other.metadata["agentId"]
            for mine, its in zip(one.events, other.events, strict=True):
                assert_same(mine, its)


def test_depth_comes_in_the_format_that_the_client_wants(server):
    """1.653 m to the fridge's front, see test_controller."""
    millimetres = ai2thor.server.DepthFormat.Millimeters
    wanted = {"depth_format": millimetres, "renderDepthImage": True}
    with (
        launch(**wanted, **server) as played,
        EmbeddedController(scene="FloorPlan1", **SMALL, **wanted) as ours,
    ):
        pose = {"x": 1.0, "z": 1.25, "rotation": 270, "horizon": 0}
        one, other = (controller.step("TeleportFull", **pose) for controller in (played, ours))
        assert one.depth_frame[24, 32] == pytest.approx(2652.83, abs=60)
        assert_same_picture(one.depth_frame, other.depth_frame)


# -- settings and sizes ----------------------------------------------------------------------------


def test_resolution_and_scene_can_be_changed(played):
    assert played.last_event.frame.shape == (48, 64, 3)
    assert played.step("ChangeResolution", x=100, y=50).frame.shape == (50, 100, 3)
    event = played.reset("FloorPlan201", width=320, height=200)
    assert event.frame.shape == (200, 320, 3)
    assert event.metadata["sceneName"] == "FloorPlan201_physics"
    assert played.reset("FloorPlan1").frame.shape == (200, 320, 3)


def test_headless_sends_no_picture():
    with launch(headless=True) as played:
        event = played.step("RotateRight")
        assert event.frame is None
        assert event.metadata["agent"]["rotation"]["y"] == 0  # it starts at 270


def test_where_nothing_has_changed_a_patch_is_sent(played):
    """Unity's fastActionEmit; a whole message holds all objects, some 90 kB of them."""
    before = played.step("RotateRight", degrees=30)
    event = played.step("GetReachablePositions")
    assert len(event.metadata["actionReturn"]) > 50
    assert event.metadata["lastAction"] == "GetReachablePositions"
    assert event.metadata["objects"] is before.metadata["objects"]
    assert event.frame.tobytes() == before.frame.tobytes()
    assert played.step("Pass").metadata["objects"] is not before.metadata["objects"]
    played.reset(fastActionEmit=False)
    before = played.step("Pass")
    event = played.step("GetReachablePositions")
    assert event.metadata["objects"] is not before.metadata["objects"]
    assert event.metadata["objects"] == before.metadata["objects"]


# -- errors ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "named"),
    [
        ({"action": "Fly"}, "Invalid action: Fly"),
        ({"action": "PickupObject"}, "objectId"),
        ({"action": "RotateRight", "degrees": "far"}, "degrees"),
        ({"action": "Fly\ud800"}, "no action"),
    ],
)
def test_wrong_calls_raise_value_error_and_the_player_lives(played, request_, named):
    with pytest.raises(ValueError, match=named):
        played.step(**request_)
    assert played.step("Pass").metadata["lastActionSuccess"]


def test_what_is_odd_goes_over_either_transport(server):
    """Three megabytes of request, NaN, characters that nothing can encode."""
    with launch(headless=True, **server) as played:
        for request, named in (
            ({"action": "PickupObject", "objectId": "Mug|" + "9" * 3_000_000}, None),
            ({"action": "RotateRight", "degrees": float("nan")}, "nan"),
            ({"action": "Fly\ud800"}, "no action"),
            ({"action": "--\r\nContent-Type: text/plain\r\n\r\n"}, "no action"),
        ):
            event, error = do(played, request)
            assert not event, request
            assert named is None or named in error
        assert played.step("Pass")


def test_a_refusal_is_falsy_or_raises(played):
    assert not played.step("DropHandObject")
    with pytest.raises(RuntimeError, match="empty"):
        played.step("DropHandObject", raise_for_failure=True)


@pytest.mark.parametrize("make", [launch, EmbeddedController])
def test_a_house_that_cannot_be_built_is_refused_with_a_reason(make):
    with make(scene="FloorPlan1", headless=True) as controller:
        event = controller.reset({"rooms": []})
        assert "the house has no rooms" in event.metadata["errorMessage"]
        assert event.metadata["sceneName"] == "Procedural"


# -- beginnings and ends ---------------------------------------------------------------------------


def test_the_launcher_is_a_program_that_says_what_it_is_for(home):
    path = er_gym.thor_executable()
    assert path == er_gym.thor_executable()
    assert os.access(path, os.X_OK)
    assert Path(path).is_relative_to(home)
    done = subprocess.run([path], capture_output=True, text=True)
    assert done.returncode == 2
    assert "local_executable_path" in done.stderr


def test_a_path_with_spaces_works(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "a 'quoted' cache"))
    with launch() as played:
        assert played.last_event.frame is not None


def test_where_nothing_can_be_written_the_command_itself_is_launched(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert er_gym.thor_executable().startswith(sys.executable)
    with launch(headless=True) as played:
        assert played.last_event


def test_the_player_does_without_the_client_and_gymnasium(played):
    maps = Path(f"/proc/{played.unity_pid}/maps").read_text()
    assert "numpy" in maps
    program = (
        "import runpy, sys; sys.argv = ['player']\n"
        f"try: runpy.run_path({str(launcher._START)!r}, run_name='__main__')\n"
        "except SystemExit: pass\n"
        "print([name for name in ('ai2thor', 'gymnasium', 'er_gym.envs') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.stdout == "[]\n", done.stderr


def test_stop_leaves_no_process_and_no_file(tmp_path, monkeypatch):
    pipes = tmp_path / "pipes"
    pipes.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(pipes))
    controller = launch()
    pid, server = controller.unity_pid, controller.server
    written = [
        link
        for link in map(os.readlink, Path(f"/proc/{pid}/fd").iterdir())
        if link.startswith("/") and not link.startswith(("/dev/", str(pipes)))
    ]
    assert all(link.endswith("unity.log") for link in written), written  # the client's own
    controller.stop()
    assert ends(pid)
    server.tmp_dir.cleanup()
    assert list(pipes.iterdir()) == []


def test_sigterm_ends_it_well():
    controller = launch()
    controller.server.unity_proc.terminate()
    assert controller.server.unity_proc.wait(LONG) == 0
    controller.stop()


def test_ctrl_c_is_the_clients_to_answer(played):
    played.server.unity_proc.send_signal(signal.SIGINT)
    time.sleep(0.1)
    assert played.step("Pass")


@pytest.mark.parametrize("pipe", ["client_pipe", "server_pipe"])
def test_end_of_file_on_either_pipe_ends_it_well(pipe):
    controller = launch()
    getattr(controller.server, pipe).close()
    if pipe == "server_pipe":  # the player hears of it when it answers
        controller.server.send({"action": "Pass"})
    assert controller.server.unity_proc.wait(LONG) == 0
    controller.stop()


def test_over_wsgi_it_ends_when_the_client_says_so_or_refuses_it():
    """So the client stops; and so it answers a player that is another's."""
    for end in ("stop", "refuse"):
        controller = launch(headless=True, server_class=WsgiServer)
        if end == "refuse":
            controller.server.client_token = "another's"
        controller.server.send({"action": "Pass"} if end == "refuse" else {})
        assert controller.server.unity_proc.wait(LONG) == 0
        controller.stop()


@pytest.mark.parametrize(
    ("variables", "code", "words"),
    [
        ({"AI2THOR_SERVER_TYPE": "WSGI", "AI2THOR_HOST": "127.0.0.1"}, 2, "AI2THOR_PORT"),
        ({"AI2THOR_SERVER_TYPE": "pigeon"}, 2, "'pigeon'"),
        (
            {
                "AI2THOR_SERVER_TYPE": "WSGI",
                "AI2THOR_HOST": "127.0.0.1",
                "AI2THOR_PORT": "1",  # nobody listens there
            },
            0,
            "client is gone",
        ),
    ],
)
def test_what_the_environment_lacks_is_said(variables, code, words):
    done = subprocess.run(
        [er_gym.thor_executable()],
        capture_output=True,
        text=True,
        env={**os.environ, **variables},
        timeout=LONG,
    )
    assert done.returncode == code
    assert words in done.stderr
    assert "Traceback" not in done.stderr


PARENT = """
import sys, time
from ai2thor.controller import Controller
from ai2thor.fifo_server import FifoServer
if sys.argv[2] == "before":  # neither pipe is open yet
    def receive(server, timeout):
        print(server.unity_proc.pid, flush=True)
        time.sleep(60)
    FifoServer.receive = receive
controller = Controller(local_executable_path=sys.argv[1], x_display=":0", headless=True)
print(controller.unity_pid, flush=True)
time.sleep(60)
"""


@pytest.mark.parametrize("when", ["before", "playing"])
def test_its_parents_death_ends_it(when):
    command = [sys.executable, "-c", PARENT, er_gym.thor_executable(), when]
    parent = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    pid = int(parent.stdout.readline())
    # The shell has seen whose child it is; Python has just begun.
    assert comes(lambda: b"-parent" in Path(f"/proc/{pid}/cmdline").read_bytes())
    assert is_alive(pid)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert ends(pid)


def test_a_player_that_is_killed_is_an_error_of_the_client():
    controller = launch()
    controller.server.timeout = 1.0
    controller.server.unity_proc.kill()
    controller.server.unity_proc.wait()
    with pytest.raises((OSError, RuntimeError)):
        controller.step("Pass")
    with contextlib.suppress(BrokenPipeError):  # of what it could not send
        controller.server.client_pipe.close()
    controller.stop()


def test_the_client_restarts_a_player_that_has_crashed():
    controller = launch(server_timeout=None, headless=True)
    controller.server.unity_proc.send_signal(signal.SIGABRT)
    controller.server.unity_proc.wait()
    # Of the two ways in which the client may notice, only end of file makes it restart.
    controller.server.send = lambda action: None
    with (
        pytest.warns(UserWarning, match="Restarting unity"),
        pytest.raises(ai2thor.controller.RestartError),
    ):
        controller.step("Pass")
    assert controller.step("Pass")
    controller.stop()


def test_twenty_side_by_side():
    """Started in threads that end before the first step: it is the process that matters."""
    with ThreadPoolExecutor(20) as pool:
        fleet = list(pool.map(lambda _: launch(headless=True), range(20)))
    time.sleep(0.6)  # more than the time between looks at whether the parent lives
    for turn, controller in enumerate(fleet):
        event = controller.step("RotateRight", degrees=turn)
        assert event.metadata["agent"]["rotation"]["y"] == (270 + turn) % 360
    pids = [controller.unity_pid for controller in fleet]
    assert len(set(pids)) == 20
    for controller in fleet:
        controller.stop()
    assert all(ends(pid) for pid in pids)
