"""A small collection of real episodes, played by the solver, with short thoughts.

In every second episode the agent looks around first; in every third it tries what is not legal, so
that a turn without picture follows, and the turn of that mistake is not learnt.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from er_gym.data.collection import Collection, CollectionManifest
from er_gym.data.trajectory import (
    Language,
    PictureRecord,
    Purpose,
    SeenObject,
    ThoughtRecord,
    Trajectory,
    Turn,
)
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.solver import Solver
from er_gym.rollout.records import record_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

SIZE = {"width": 128, "height": 72}
PURPOSE: Mapping[str, Purpose] = {
    verbs.NAVIGATE: "search",
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.OPEN: "open to look",
    verbs.CLOSE: "close again",
    verbs.TOGGLE: "switch",
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "get closer",
    verbs.END: "finish",
}
IMPOSSIBLE = Action(verbs.CLOSE, "Fridge")


def play_collection(folder: Path, tasks: int = 12) -> Collection:
    """Play the first tasks of the suite ``mini`` and keep them as a collection."""
    suite = load_suite("mini")
    env = {**suite.env, **SIZE}
    manifest = CollectionManifest(suite="mini", suite_digest=suite.digest, seed=0, er_gym="0")
    collection = Collection.create(folder, manifest)
    run = Manifest(
        suite="mini",
        suite_digest=suite.digest,
        suite_size=tasks,
        agent="oracle",
        env=env,
        seed=0,
        er_gym="0",
    )
    RunDirectory.create(collection.part_path("played"), run)
    step = max(1, len(suite.tasks) // tasks)
    collection.write(_trajectories(folder, suite.tasks[::step][:tasks], env))
    return collection


def _trajectories(
    folder: Path, tasks: tuple[Task, ...], env_arguments: dict[str, Any]
) -> Iterator[Trajectory]:
    env = EmbodiedEnv((), obs_mode="rgb+objects", **env_arguments)
    for number, task in enumerate(tasks):
        first = ([Action(verbs.OBSERVE)] if number % 2 else []) + (
            [IMPOSSIBLE] if number % 3 == 0 else []
        )
        yield _play(
            env, task, folder, f"{number:02}-{task.id}", first, "zh" if number % 4 == 3 else "en"
        )
    env.close()


def _play(
    env: EmbodiedEnv, task: Task, folder: Path, name: str, first: list[Action], language: Language
) -> Trajectory:
    obs, info = env.reset(seed=0, options={"task": task})
    solver, todo, turns = Solver(), list(first), []
    changed = True
    while not info["end_reason"]:
        action = todo.pop(0) if todo else solver.next(info)[0]
        pictures = _pictures(folder, name, len(turns), obs, info) if changed else []
        shown = info
        obs, reward, _, _, info = env.step(action)
        changed = bool(info["action_success"])
        turns.append(
            Turn(
                pictures=pictures,
                view=[SeenObject.of(view) for view in shown["object_views"]],
                held=shown["held"],
                navigable=list(shown["navigable"]),
                interactable=list(shown["interactable"]),
                purpose=PURPOSE.get(action.verb, "use"),
                thoughts=_thoughts(shown, action, language, first=not turns),
                verb=action.verb,
                object_type=action.object_type,
                object_id=info["object_id"],
                success=changed,
                reward=float(reward),
                feedback=info["feedback"],
                train=changed,
            )
        )
    record = record_episode(task, agent="oracle", seed=0)
    return Trajectory(
        id=name,
        task_id=task.id,
        task_type=record.task_type,
        scene=task.scene,
        instruction=task.instruction,
        name=record.name,
        key_actions=record.key_actions,
        search_targets=record.search_targets or [],
        seed=0,
        part="played",
        kind="b",
        language=language,
        max_steps=info["max_steps"],
        turns=turns,
        success=info["success"],
        end_reason=info["end_reason"],
    )


def _pictures(
    folder: Path, name: str, turn: int, obs: Mapping[str, Any], info: Mapping[str, Any]
) -> list[PictureRecord]:
    views: dict[str, NDArray[np.uint8]] = {"ahead": obs["rgb"], **info.get("views", {})}
    if len(views) > 1:
        del views["ahead"]
    records = []
    for direction, pixels in views.items():
        path = f"parts/played/pictures/{name}/{turn:03}-{direction}.jpeg"
        (folder / path).parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(pixels).save(folder / path)
        records.append(PictureRecord(path=path, direction=direction, **SIZE))
    return records


def _thoughts(
    info: Mapping[str, Any], action: Action, language: Language, *, first: bool
) -> list[ThoughtRecord]:
    seen = ", ".join(dict.fromkeys(view.object_type for view in info["object_views"][:3]))
    if language == "zh":
        look, think = f"我看到了 {seen}。", f"接下来应该做 {action}。"
    else:
        look, think = f"I see {seen or 'nothing'} here.", f"What I need now is to {action}."
    planned = ThoughtRecord(kind="planning", text=think)
    if first:
        return [ThoughtRecord(kind="analysis", text=look), planned]
    if info["action"] is not None and not info["action_success"]:
        return [ThoughtRecord(kind="reflection", text=think)]
    return [ThoughtRecord(kind="reasoning", text=f"{look} {think}")]
