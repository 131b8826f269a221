"""Observations state the sensors that they need; only these are requested and drawn."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from er_gym.envs import embodied_env, observations
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.observations import FAR, OBSERVATIONS, Observation
from er_gym.envs.perception import SENSORS
from er_gym.sim.render import panda

SMALL = {"width": 96, "height": 64}
_FLAGS = ("renderDepthImage", "renderInstanceSegmentation", "renderSemanticSegmentation")


def asked_for(
    monkeypatch: pytest.MonkeyPatch, obs_mode: str, backend: str = "embedded", **arguments: Any
) -> Mapping[str, Any]:
    """What an environment asks of its controller, which is not made."""
    asked: dict[str, Any] = {}

    def make(name: str, **given: Any) -> Any:
        asked.update(given, backend=name)
        raise InterruptedError

    monkeypatch.setattr(embodied_env, "make_controller", make)
    env = EmbodiedEnv(obs_mode=obs_mode, backend=backend, **arguments)
    with pytest.raises(InterruptedError):
        env.reset(seed=0)
    assert asked["backend"] == backend
    return asked


@pytest.mark.parametrize("backend", ["embedded", "unity"])
@pytest.mark.parametrize(
    ("obs_mode", "flags"),
    [
        ("state+text", None),
        ("rgb", ""),
        ("depth+text", "renderDepthImage"),
        ("instance", "renderInstanceSegmentation"),
        ("rgb+depth+instance", "renderDepthImage renderInstanceSegmentation"),
    ],
)
def test_the_controller_is_asked_for_what_observations_need(
    obs_mode: str, flags: str | None, backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = asked_for(monkeypatch, obs_mode, backend)
    assert asked["headless"] == (flags is None)
    assert [name for name in _FLAGS if asked.get(name)] == (flags or "").split()


def test_names_in_pictures_need_instances_where_anything_is_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert asked_for(monkeypatch, "rgb", annotate=True)["renderInstanceSegmentation"]
    assert asked_for(monkeypatch, "text", annotate=True)["headless"]


def test_an_observation_names_the_sensors_there_are() -> None:
    def space(width: int, height: int) -> spaces.Space[Any]:
        return spaces.Discrete(2)

    for wrong in (("sonar",), "depth", ["depth"], (["depth"],)):
        with pytest.raises(ValueError, match=r"needs .*; give a tuple of sensors, of frame, depth"):
            Observation(space, lambda situation: 0, needs=wrong)  # type: ignore[arg-type]


def test_depth_and_instances_are_those_of_the_event() -> None:
    env = EmbodiedEnv(obs_mode="depth+instance", **SMALL)
    obs, _ = env.reset(seed=3)
    for action in ("observe", "navigate to Fridge", "move forward"):
        event = env._controller.last_event
        assert obs in env.observation_space
        assert (obs["depth"] == event.depth_frame).all()
        ids = np.array(env.details["instance_ids"])
        in_picture = {number for number in np.unique(obs["instance"]).tolist() if number}
        assert set(ids[sorted(in_picture)]) == set(event.instance_masks)
        for object_id, mask in event.instance_masks.items():
            assert ((ids[obs["instance"]] == object_id) == mask).all()
        assert {number for number, name in enumerate(ids) if name} == in_picture
        obs, *_ = env.step(action)
    env.close()


def test_numbers_stay_true_when_objects_come_and_go() -> None:
    """Slicing takes a whole away and adds slices."""
    env = EmbodiedEnv(obs_mode="instance", instances="explore", width=300, height=200)
    env.reset(seed=0, options={"scene": "FloorPlan1"})
    for entry in env.objects:
        if entry["sliceable"]:
            env._controller.step(action="SliceObject", objectId=entry["objectId"])
    seen: set[str] = set()
    for action in ("navigate to CounterTop", "navigate to CounterTop", "observe"):
        obs, *_ = env.step(action)
        ids = np.array(env.details["instance_ids"])
        masks = env._controller.last_event.instance_masks
        assert set(ids[np.unique(obs["instance"])]) == {"", *masks}
        for object_id, mask in masks.items():
            assert ((ids[obs["instance"]] == object_id) == mask).all()
        seen |= set(masks)
    assert any("Sliced" in name for name in seen)
    env.close()


def test_far_is_where_the_engine_stops_drawing() -> None:
    assert panda.FAR == FAR
    space = OBSERVATIONS.get("depth").space(4, 3)
    assert (space.low.min(), space.high.max(), space.shape) == (0.0, FAR, (3, 4))


def test_what_simulators_say_of_nothing_fits_into_the_space() -> None:
    class Situation:
        class perception:
            depth = np.array([[np.inf, 99.0, -1.0, 2.5]], dtype=np.float32)

    assert observations._depth(Situation).tolist() == [[FAR, FAR, 0.0, 2.5]]  # type: ignore[arg-type]


def test_instances_leave_pictures_unnamed() -> None:
    arguments = {"options": {"scene": "FloorPlan201"}, "seed": 0}
    pictures = []
    for obs_mode in ("rgb", "rgb+depth+instance"):
        env = EmbodiedEnv(obs_mode=obs_mode, **SMALL)
        pictures.append(env.reset(**arguments)[0]["rgb"])
        env.close()
    assert (pictures[0] == pictures[1]).all()


def test_observations_are_the_callers_own() -> None:
    env = EmbodiedEnv(obs_mode="rgb+depth+instance", **SMALL)
    first, _ = env.reset(seed=0)
    kept = {name: array.copy() for name, array in first.items()}
    for array in first.values():
        array[:] = 1
    again, *_ = env.step("open Moon")  # not understood: the percept is that of before
    for name, array in again.items():
        assert (array == kept[name]).all()
    env.close()


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 5), (5, 1)])
def test_the_smallest_pictures_keep_their_shape(width: int, height: int) -> None:
    env = EmbodiedEnv(obs_mode="rgb+depth+instance", width=width, height=height)
    assert env.reset(seed=0)[0] in env.observation_space
    env.close()


def test_vector_environments_stack_them() -> None:
    vec = gymnasium.make_vec(
        "ER-SinglePickup-v0",
        num_envs=2,
        vectorization_mode="async",
        obs_mode="depth+instance",
        **SMALL,
    )
    obs, _ = vec.reset(seed=[5, 6])
    alone = gymnasium.make("ER-SinglePickup-v0", obs_mode="depth+instance", **SMALL)
    for k, seed in enumerate((5, 6)):
        one, _ = alone.reset(seed=seed)
        assert (obs["depth"][k] == one["depth"]).all()
        assert (obs["instance"][k] == one["instance"]).all()
        assert vec.get_attr("details")[k]["instance_ids"] == alone.unwrapped.details["instance_ids"]
    assert (obs["depth"].dtype, obs["instance"].dtype) == (np.float32, np.int32)
    vec.close()
    alone.close()


def test_an_observation_of_another_package_reads_classes() -> None:
    seen = Observation(
        space=lambda width, height: spaces.Box(0, 255, (height, width, 3), np.uint8),
        build=lambda situation: np.array(situation.perception.classes),
        needs=("classes",),
    )
    assert set(SENSORS) >= set(seen.needs)
    env = EmbodiedEnv(obs_mode="text", **SMALL)
    env._settings = replace(env._settings, observations={"classes": seen})
    env._controller_arguments |= {"headless": False, **SENSORS["classes"]}
    obs, _ = env.reset(seed=0)
    assert obs["classes"].shape == (64, 96, 3)
    assert (obs["classes"] == env._controller.last_event.semantic_segmentation_frame).all()
    env.close()
