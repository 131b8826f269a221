"""Programs that start AI2-THOR in the ways that the world's programs do."""

from __future__ import annotations

import json
import os
import signal
import time
from pathlib import Path

PLAIN = """
from ai2thor.controller import Controller
controller = Controller(scene="FloorPlan1")
event = controller.step("MoveAhead")
print(event.metadata["sceneName"], len(event.metadata["objects"]), event.frame.shape)
print(controller._build.platform.__name__)
controller.stop()
"""
KITCHEN = "FloorPlan1_physics 77 (300, 300, 3)"


def test_a_scene_is_all_that_a_program_need_name(user):
    """No DISPLAY, no X server, no Vulkan library, no network."""
    assert user.run(PLAIN) == [KITCHEN, "Linux64"]


def test_a_program_need_not_even_name_a_scene(user):
    """The client takes the first that the build lists."""
    program = """
import ai2thor.controller
with ai2thor.controller.Controller(headless=True) as controller:
    print(controller.last_event.metadata["sceneName"], controller.last_event.frame)
"""
    assert user.run(program) == ["FloorPlan10_physics None"]


CHOICES = """
import os
from ai2thor.controller import Controller
from ai2thor.platform import CloudRendering, Linux64
choices = (
    {},
    {"x_display": ":0"},
    {"x_display": "0.0", "width": 4000, "height": 3000},
    {"platform": Linux64, "headless": True},
    {"platform": "Linux64", "gpu_device": 0},
    {"platform": CloudRendering},
    {"platform": CloudRendering, "x_display": ":3", "gpu_device": 7},
    {"quality": "Very Low", "fullscreen": True},
)
for display in (None, ":0", "elsewhere.invalid:10.0"):
    if display is not None:
        os.environ["DISPLAY"] = display
    builds = [Controller(download_only=True, **choice)._build for choice in choices]
    print(*(build.platform.__name__ for build in builds))
os.environ["CUDA_VISIBLE_DEVICES"] = "255, 7"
with Controller(scene="FloorPlan1", **choices[5]) as controller:
    print(controller.gpu_device, controller.step("Pass").metadata["sceneName"])
del os.environ["CUDA_VISIBLE_DEVICES"], os.environ["DISPLAY"]
executable = {"local_executable_path": builds[0].executable_path, "gpu_device": 3}
with Controller(scene="FloorPlan1", headless=True, **executable) as controller:
    print(controller.gpu_device, controller.step("Pass").metadata["sceneName"])
"""


def test_whatever_is_said_of_displays_and_gpus_the_player_starts(user):
    """``download_only`` is the client's way to choose a build and not to start it."""
    chosen = " ".join(["Linux64"] * 5 + ["CloudRendering"] * 2 + ["Linux64"])
    played = ["255 FloorPlan1_physics", "3 FloorPlan1_physics"]
    assert user.run(CHOICES) == [chosen] * 3 + played


WSGI = """
import hashlib, socket
import ai2thor.fifo_server, ai2thor.wsgi_server
from ai2thor.controller import Controller
from ai2thor.platform import CloudRendering

def play(**settings):
    with Controller(scene="FloorPlan402", width=120, height=90, **settings) as controller:
        for action in ("MoveAhead", "RotateLeft", "LookDown", "PickupObject"):
            try:
                event = controller.step(action)
                yield [event.metadata["lastActionSuccess"], event.metadata["agent"]]
                yield hashlib.sha256(event.frame.tobytes()).hexdigest()
            except ValueError as error:
                yield str(error)
        yield controller.reset("FloorPlan2").metadata["objects"]

fifo = list(play(server_class=ai2thor.fifo_server.FifoServer))
with socket.socket() as sock:
    sock.bind(("127.0.0.1", 0))
    port = sock.getsockname()[1]
wsgi = {"server_class": ai2thor.wsgi_server.WsgiServer, "host": "127.0.0.1", "port": port}
print(len(fifo), fifo == list(play(**wsgi, platform=CloudRendering)))
"""


def test_a_program_may_ask_for_wsgi(user):
    assert user.run(WSGI) == ["8 True"]


MANY = """
from concurrent.futures import ThreadPoolExecutor
from ai2thor.controller import Controller

def turn(degrees):
    with Controller(scene="FloorPlan1", width=64, height=48, headless=True) as controller:
        agent = controller.step("Teleport", rotation=dict(x=0, y=degrees, z=0)).metadata["agent"]
        return agent["rotation"]["y"]

with ThreadPoolExecutor(3) as pool:
    print([round(angle) for angle in pool.map(turn, (10, 20, 30))])
"""


def test_several_controllers_live_side_by_side(user):
    assert user.run(MANY) == ["[10, 20, 30]"]


WAITING = """
import time
from ai2thor.controller import Controller
from ai2thor.wsgi_server import WsgiServer
controller = Controller(scene="FloorPlan1", headless=True, server_class=WsgiServer)
print(controller.unity_pid, flush=True)
time.sleep(60)
"""


def test_the_player_ends_when_its_program_is_killed(user):
    program = user.start("-c", WAITING)
    assert program.stdout is not None
    pid = int(program.stdout.readline())
    os.kill(pid, 0)  # it is there
    program.send_signal(signal.SIGKILL)
    program.communicate()
    deadline = time.monotonic() + 60
    while Path(f"/proc/{pid}").exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not Path(f"/proc/{pid}").exists()


# -- installing ------------------------------------------------------------------------------------


def listing(folder: Path) -> dict[str, bytes]:
    """Every file but the client's locks."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.suffix != ".lock"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


CHOOSE = """
from ai2thor.controller import Controller
print(Controller(download_only=True)._build.platform.__name__)
"""
OFFLINE = {"http_proxy": "http://127.0.0.1:9", "https_proxy": "http://127.0.0.1:9"}


def test_uninstall_takes_away_what_install_has_put_there(new_user):
    """In the home and in the environment; and a real build is tested for a display as ever."""
    someone = new_user("someone")
    code, _, err = someone.try_to("-c", CHOOSE, **OFFLINE)
    assert code == 1
    assert "no build exists" in err
    before = listing(someone.home.parent)
    someone.er_gym("player", "install")
    assert someone.run(CHOOSE) == ["Linux64"]
    (marker,) = someone.home.glob(".ai2thor/releases/thor-Linux64-*/installed-by-er-gym.json")
    marker.rename(marker.with_name("kept"))  # without it the build is anybody's
    code, _, err = someone.try_to("-c", CHOOSE)
    assert code == 1
    assert "No valid X display found" in err
    marker.with_name("kept").rename(marker)
    someone.er_gym("player", "uninstall")
    assert listing(someone.home.parent) == before


def test_an_environment_without_the_hook_is_told_what_to_do(user, new_user):
    """The home has the player; the environment has what spares the display."""
    visitor = type(user)(user.home, new_user("other").python)
    code, _, err = visitor.try_to("-c", CHOOSE)
    assert code == 1
    assert "No valid X display found" in err
    (line,) = [line for line in visitor.er_gym("doctor") if "Controller(scene" in line]
    assert line.startswith("--")
    assert "er-gym player install" in line
    assert "xvfb-run" in line
    user.er_gym("player", "install", "--python", str(visitor.python))
    assert visitor.run(CHOOSE) == ["Linux64"]
    hooks = json.loads((user.home / ".ai2thor" / "hooks-by-er-gym.json").read_text())["hooks"]
    assert len(hooks) == 2
