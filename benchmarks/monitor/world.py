"""What an episode's room was like: the episode is played again, by the record of its actions.

The embedded engine repeats itself exactly, so the record of the actions is enough for where the
agent stood, what it could see, and what was there but hidden.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.monitor.sensor_pictures import SHOWN
from er_gym.envs.actions import NO_ACTION, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.rollout.run_directory import Manifest
from er_gym.tasks.suites import load_suite, suite_names
from er_gym.tasks.task import Task
from er_gym.thor import make_controller

GRID = 0.25
"""The side of a square of floor, metres."""
_MOST_KEPT = 16


DRAWN: Mapping[str, str] = {"rgb": "text", "depth": "depth", "instance": "instance"}
"""What can be drawn of a moment, and the observation of the environment that draws it."""


class CannotReplay(ValueError):
    """An episode cannot be played again; the message says why."""


@dataclass(frozen=True)
class Footprint:
    """An object seen from above.

    Attributes:
        object_id, object_type: AI2-THOR's.
        x, z: its centre, metres in the world's frame.
        width, depth: along x and z, metres.
        holds: whether it is a receptacle that cannot be carried: furniture.
        inside: the id of the closed receptacle that hides it at first; "" for none.
    """

    object_id: str
    object_type: str
    x: float
    z: float
    width: float
    depth: float
    holds: bool
    inside: str


@dataclass(frozen=True)
class Stand:
    """Where the agent stood after a step.

    Attributes:
        x, z: metres. rotation: degrees, clockwise from +z.
        held: the type in its hand; "" for nothing.
        visible: the ids of the objects in view.
    """

    x: float
    z: float
    rotation: float
    held: str
    visible: frozenset[str]


@dataclass(frozen=True)
class World:
    """A room and the agent's way through it.

    Attributes:
        floor: (N, 2) x and z of the squares on which one can stand, metres.
        objects: as they were at first.
        stands: one for each step of the record, from the first, which placed the agent.
        field_of_view: horizontal, degrees.
        differs: the number of the first step that came out differently; None if none did.
    """

    floor: NDArray[np.float64]
    objects: Sequence[Footprint]
    stands: Sequence[Stand]
    field_of_view: float
    differs: int | None


class Worlds:
    """Plays episodes again, one at a time, and keeps the last ones."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._kept: OrderedDict[tuple[str, str], World] = OrderedDict()
        self._env: tuple[str, EmbodiedEnv] | None = None

    def world(self, manifest: Manifest, record: EpisodeRecord) -> World:
        """The room of an episode.

        Raises:
            CannotReplay: its task is not at hand, or it was not played on the embedded engine.
        """
        did = hash(tuple((step.verb, step.object_type) for step in record.steps))
        name = (manifest.digest, f"{record.key} {record.seed} {did}")
        with self._lock:
            if name in self._kept:
                self._kept.move_to_end(name)
                return self._kept[name]
            task = task_of(manifest, record)
            angle = _horizontal(manifest.env)
            found = _played_again(self._environment(manifest), task, record, angle)
            self._kept[name] = found
            while len(self._kept) > _MOST_KEPT:
                self._kept.popitem(last=False)
            return found

    def frame(
        self, manifest: Manifest, record: EpisodeRecord, number: int, what: str = "rgb"
    ) -> NDArray[np.uint8]:
        """(height, width, 3) uint8: what the agent could see after a step.

        Args:
            manifest, record: of the episode.
            number: of the step.
            what: one of :data:`DRAWN`.

        Raises:
            CannotReplay: as above, or there is no such step.
        """
        with self._lock:
            task = task_of(manifest, record)
            env = self._environment(manifest, DRAWN[what])
            obs, _ = env.reset(seed=record.seed, options={"task": task})
            for step in record.steps[1 : number + 1]:
                if not step.appended:
                    obs, *_ = env.step(action_in(step.verb, step.object_type))
            picture = SHOWN[what](obs[what]) if what in SHOWN else env.render()
            if not isinstance(picture, np.ndarray):
                raise CannotReplay("nothing is drawn")
            return picture

    def frames(self, manifest: Manifest, record: EpisodeRecord) -> Iterator[NDArray[np.uint8]]:
        """(height, width, 3) uint8: what the agent could see after each step, from the first.

        The episode is played once; meanwhile nothing else is. It ends early where the episode
        comes out differently.

        Raises:
            CannotReplay: as above.
        """
        with self._lock:
            env = self._environment(manifest)
            env.reset(seed=record.seed, options={"task": task_of(manifest, record)})
            for number, step in enumerate(record.steps):
                if number and not step.appended:
                    try:
                        env.step(action_in(step.verb, step.object_type))
                    except ValueError:
                        return
                picture = env.render()
                if picture is None:
                    raise CannotReplay("nothing is drawn")
                yield np.asarray(picture)

    def _environment(self, manifest: Manifest, obs_mode: str = "text") -> EmbodiedEnv:
        wanted = f"{manifest.digest} {obs_mode}"
        if self._env is None or self._env[0] != wanted:
            if self._env is not None:
                self._env[1].close()
            self._env = wanted, environment_of(manifest, obs_mode)
        return self._env[1]


def environment_of(manifest: Manifest, obs_mode: str = "text") -> EmbodiedEnv:
    """An environment like that of a run, with other observations; it renders pictures.

    Raises:
        CannotReplay: the run was not played on the embedded engine.
    """
    if manifest.env.get("backend", "embedded") != "embedded":
        raise CannotReplay("it was played on another backend, which does not repeat itself")
    given = {**manifest.env, "obs_mode": obs_mode, "render_mode": "rgb_array"}
    try:
        return EmbodiedEnv((), **given)
    except (TypeError, ValueError) as error:
        raise CannotReplay(str(error)) from None


def task_of(manifest: Manifest, record: EpisodeRecord) -> Task:
    """The task of an episode.

    Raises:
        CannotReplay: it is not at hand.
    """
    return task_at(manifest, record.task_id)


def task_at(manifest: Manifest, task_id: str) -> Task:
    """A task of a run's suite.

    Raises:
        CannotReplay: it is not at hand.
    """
    # Only er-gym's own suites: another name could be a module, which would be run.
    if manifest.suite not in suite_names():
        raise CannotReplay(f"{manifest.suite} is none of er-gym's own suites")
    digest, tasks = _tasks(manifest.suite)
    if digest != manifest.suite_digest:
        raise CannotReplay(f"the suite {manifest.suite} has changed since")
    if task_id not in tasks:
        raise CannotReplay(f"{manifest.suite} has no task {task_id}")
    return tasks[task_id]


@lru_cache(maxsize=2)
def _tasks(name: str) -> tuple[str, Mapping[str, Task]]:
    suite = load_suite(name)
    return suite.digest, {task.id: task for task in suite.tasks}


def action_in(verb: str, object_type: str) -> Action | str:
    """What was said to the environment in a step of a record."""
    return NO_ACTION if verb == ERROR else Action(verb, object_type)


def _played_again(env: EmbodiedEnv, task: Task, record: EpisodeRecord, angle: float) -> World:
    _, info = env.reset(seed=record.seed, options={"task": task})
    objects = tuple(map(_footprint, _with_hidden(env.objects)))
    stands, differs = [_stand(env, info)], None
    for number, step in enumerate(record.steps[1:], 1):
        if step.appended:
            break
        try:
            _, _, over, cut, info = env.step(action_in(step.verb, step.object_type))
        except ValueError:
            differs = number
            break
        stands.append(_stand(env, info))
        if bool(info["action_success"]) != step.success and differs is None:
            differs = number
        if over or cut:
            break
    stands += [stands[-1]] * (len(record.steps) - len(stands))
    return World(_floor(task.scene), objects, stands, angle, differs)


@lru_cache(maxsize=120)
def _floor(scene: str) -> NDArray[np.float64]:
    """(n, 2): x and z of the places where an agent can stand, metres."""
    controller = make_controller(scene=scene, gridSize=GRID, headless=True)
    try:
        places = controller.step(action="GetReachablePositions").metadata["actionReturn"]
    finally:
        controller.stop()
    return np.array([(each["x"], each["z"]) for each in places], float)


def _horizontal(env: Mapping[str, Any]) -> float:
    """The horizontal field of view, degrees; AI2-THOR states the vertical one."""
    half = math.radians(float(env.get("field_of_view", 90.0)) / 2)
    wide = float(env.get("width", 800)) / float(env.get("height", 450))
    return 2 * math.degrees(math.atan(math.tan(half) * wide))


def _stand(env: EmbodiedEnv, info: Mapping[str, Any]) -> Stand:
    pose = env.agent_pose
    visible = frozenset(each["objectId"] for each in env.objects if each["visible"])
    return Stand(pose.x, pose.z, pose.rotation, info["held"], visible)


def _with_hidden(
    objects: Sequence[Mapping[str, Any]],
) -> list[tuple[Mapping[str, Any], str]]:
    """Each object, and the closed receptacle that it is in."""
    by_id = {each["objectId"]: each for each in objects}

    def hider(one: Mapping[str, Any]) -> str:
        for name in one["parentReceptacles"] or ():
            holder = by_id.get(name)
            if holder is not None and holder["openable"] and not holder["isOpen"]:
                return str(name)
        return ""

    return [(each, hider(each)) for each in objects]


def _footprint(told: tuple[Mapping[str, Any], str]) -> Footprint:
    one, inside = told
    box = one["axisAlignedBoundingBox"]
    return Footprint(
        object_id=one["objectId"],
        object_type=one["objectType"],
        x=box["center"]["x"],
        z=box["center"]["z"],
        width=box["size"]["x"],
        depth=box["size"]["z"],
        holds=bool(one["receptacle"] and not one["pickupable"]) and one["objectType"] != "Floor",
        inside=inside,
    )
