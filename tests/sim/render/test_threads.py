"""Several worlds drawn by as many threads: each gets its own pictures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from hashlib import sha256
from typing import Any

import numpy as np
import pytest

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.sim.engine import Engine
from er_gym.sim.render import scene_graph as scene_graph
from er_gym.sim.render.panda import DRAWING
from er_gym.sim.render.view import View
from tests.sim.render.test_scene_graph import camera_of, one, world_of

_THREADS = 4
_FLAGS = {"renderInstanceSegmentation": True, "renderSemanticSegmentation": True}


def _play(seed: int, scenes: tuple[str, ...], size: tuple[int, int]) -> Iterator[str]:
    """Digests of all that is drawn in some steps and resets."""
    random, engine = np.random.default_rng(seed), Engine(*size)
    for scene in scenes:
        engine.step({"action": "Reset", "sceneName": scene})
        engine.step({"action": "Initialize", "renderDepthImage": True})
        engine.step({"action": "InitialRandomSpawn", "randomSeed": seed})
        for action in ("AddThirdPartyCamera", *random.choice(_STEPS, 7)):
            request: dict[str, Any] = {"action": str(action), "forceAction": True, **_FLAGS}
            if action == "AddThirdPartyCamera":
                request |= {"position": {"x": 0, "y": 1.5, "z": 0}, "rotation": {"x": 0, "y": 40}}
                request["rotation"]["z"] = 0
            if action.endswith("Object"):
                able = "openable" if action == "OpenObject" else "pickupable"
                objects = engine.step({"action": "Pass", "renderImage": False})[0]["objects"]
                request["objectId"] = random.choice([o["objectId"] for o in objects if o[able]])
            _, view = engine.step(request)
            assert view is not None
            yield _digest(view)


_STEPS = ("MoveAhead", "RotateRight", "LookDown", "LookUp", "OpenObject", "PickupObject", "Crouch")


def _digest(view: View) -> str:
    found = sha256()
    for each in (view, *view.third_party):
        for picture in (each.rgb, each.depth, each.instances, each.classes):
            assert picture is not None
            found.update(picture.tobytes())
    return found.hexdigest()


_ROOMS = {
    "one room": ((("FloorPlan403",) * 2, (200, 200)),) * _THREADS,
    "several rooms and sizes": (
        (("FloorPlan403", "FloorPlan301"), (300, 300)),
        (("FloorPlan301", "FloorPlan403"), (800, 450)),
        (("FloorPlan403", "FloorPlan403"), (300, 300)),
        (("FloorPlan301", "FloorPlan301"), (200, 100)),
    ),
}


@pytest.mark.parametrize("rooms", _ROOMS)
def test_threads_get_the_frames_that_they_would_get_alone(rooms: str) -> None:
    def play(seed: int) -> list[str]:
        return list(_play(seed, *_ROOMS[rooms][seed]))

    alone = [play(seed) for seed in range(_THREADS)]
    assert len({digest for each in alone for digest in each}) > 25
    with ThreadPoolExecutor(_THREADS) as threads:
        assert list(threads.map(play, range(_THREADS))) == alone


def test_environments_step_and_reset_in_threads() -> None:
    def play(seed: int) -> list[Any]:
        env = EmbodiedEnv("mini", obs_mode="rgb", width=300, height=300)
        random, found = np.random.default_rng(seed), []
        for episode in range(2):
            observation, info = env.reset(seed=episode)  # the same room for all
            for _ in range(8):
                found.append(sha256(observation["rgb"].tobytes()).hexdigest())
                action = int(random.choice(np.flatnonzero(info["action_mask"])))
                observation, _, ended, cut, info = env.step(action)
                if ended or cut:
                    break
        env.close()
        return found

    alone = [play(seed) for seed in range(_THREADS)]
    with ThreadPoolExecutor(_THREADS) as threads:
        assert list(threads.map(play, range(_THREADS))) == alone


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError])
def test_an_interrupted_picture_spoils_no_other(
    error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Wherever it is interrupted: the room is drawn as before, and by other threads too."""
    plain, changed = world_of("FloorPlan403"), world_of("FloorPlan403")
    for i in (one(changed, "ToiletPaper"), one(changed, "SoapBottle")):
        changed.move_by(i, np.array([0.2, 0.3, 0.1]))
    graph = scene_graph.scene_graph_of("FloorPlan403")
    pictures = [graph.draw(world, camera_of(world)).rgb for world in (plain, changed)]
    assert (pictures[0] != pictures[1]).any()

    for name, count in (("_put", 0), ("_put", 1), ("rasteriser", 0)):
        with monkeypatch.context() as patch:
            patch.setattr(scene_graph, name, _interrupted(getattr(scene_graph, name), error, count))
            with pytest.raises(error):
                graph.draw(plain, camera_of(plain))
        for world, picture in zip((plain, changed), pictures, strict=True):
            found: list[np.ndarray] = []
            _in_a_thread(lambda world=world, found=found: found.append(  # type: ignore[misc]
                scene_graph.scene_graph_of("FloorPlan403").draw(world, camera_of(world)).rgb
            ))  # fmt: skip
            assert (found[0] == picture).all()


def _interrupted(
    function: Callable[..., Any], error: type[BaseException], after: int
) -> Callable[..., Any]:
    """The same function, but that a call fails after so many."""
    calls = iter(range(after))

    def called(*arguments: Any) -> Any:
        if next(calls, None) is None:
            raise error
        return function(*arguments)

    return called


def _in_a_thread(function: Callable[[], None]) -> None:
    thread = threading.Thread(target=function, daemon=True)
    thread.start()
    thread.join(20)
    assert not thread.is_alive(), "the renderer is locked for good"


def test_nobody_draws_while_the_lock_is_held() -> None:
    world = world_of("FloorPlan403")
    done = threading.Event()

    def draw() -> None:
        scene_graph.scene_graph_of("FloorPlan403").draw(world, camera_of(world))
        done.set()

    with DRAWING:
        thread = threading.Thread(target=draw, daemon=True)
        thread.start()
        assert not done.wait(0.3)
    thread.join(20)
    assert done.is_set()
