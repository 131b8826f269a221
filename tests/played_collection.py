"""Makes a collection of real episodes, with plain thoughts, for tests that read collections."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from er_gym.data.collection import PARTS, Collection, CollectionManifest
from er_gym.data.pictures import encode_picture
from er_gym.data.trajectory import (
    Language,
    PictureRecord,
    SeenObject,
    ThoughtKind,
    ThoughtRecord,
    Trajectory,
    Turn,
)
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.solver import Solver
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import record_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

SUITE = load_suite("mini")
IMITATION = tuple(SUITE.tasks[place] for place in (0, 24, 48, 60))
ANOMALIES = tuple(SUITE.tasks[place] for place in (61, 96, 108))
PLACES = {"imitation": IMITATION, "anomalies": ANOMALIES}
FAULTS = {"imitation": 0.0, "anomalies": 0.4}
_WORDS: Mapping[Language, Mapping[ThoughtKind, str]] = {
    "en": {
        "analysis": "I look around. There is a {seen} in front of me.",
        "reasoning": "That worked, so the next thing to do is to {action}.",
        "planning": "My plan is to {action}.",
        "reflection": "That did not work. I should {action}.",
        "verification": "Let me check once more: everything is done.",
    },
    "zh": {
        "analysis": "我先看看四周。前面有一个{seen}。",
        "reasoning": "这一步成功了，接下来{action}。",
        "planning": "我的计划是{action}。",
        "reflection": "刚才没有成功。我应该{action}。",
        "verification": "让我再检查一遍：都完成了。",
    },
}


_STEP: Mapping[Language, str] = {"en": " This is step {number}.", "zh": "这是第 {number} 步。"}


def make_collection(
    path: Path,
    *,
    parts: Sequence[str] = ("imitation", "anomalies"),
    width: int = 160,
    height: int = 90,
    language: Language = "en",
) -> Collection:
    """Play the tasks of some parts, and write what was seen, said and done."""
    manifest = CollectionManifest(
        suite=SUITE.name, suite_digest=SUITE.digest, seed=3, er_gym="0.1.0"
    )
    collection = Collection.create(path, manifest)
    found: list[Trajectory] = []
    for part in parts:
        env: dict[str, Any] = {"obs_mode": "rgb+objects", "width": width, "height": height}
        if FAULTS[part]:
            env["faults"] = FAULTS[part]
        RunDirectory.create(
            collection.part_path(part),
            Manifest(
                suite=SUITE.name,
                suite_digest=SUITE.digest,
                suite_size=len(SUITE.tasks),
                agent="expert",
                env=env,
                seed=3,
                er_gym="0.1.0",
            ),
        )
        made = EmbodiedEnv((), **env)
        found += [_played(made, task, part, path, language) for task in PLACES[part]]
        made.close()
    collection.write(found)
    return collection


def _played(
    env: EmbodiedEnv, task: Task, part: str, folder: Path, language: Language
) -> Trajectory:
    name = f"{task.id}~a"
    seed = episode_seed(3, name)
    obs, info = env.reset(seed=seed, options={"task": task})
    solver, at, over = Solver(), "", False
    turns: list[Turn] = []
    while not over:
        action = info["action"] if info.get("fault") else solver.next(info)[0]
        around = info.get("views") or {"ahead": obs["rgb"]}
        pictures: list[PictureRecord] = []
        for direction, frame in around.items():
            number = sum(len(turn.pictures) for turn in turns) + len(pictures)
            place = f"{PARTS}/{part}/pictures/{name}/{number:03}.jpeg"
            (folder / place).parent.mkdir(parents=True, exist_ok=True)
            (folder / place).write_bytes(encode_picture(frame))
            high, wide, _ = frame.shape
            pictures.append(PictureRecord(path=place, direction=direction, width=wide, height=high))
        if turns and not turns[-1].success and pictures[0].direction == "ahead":
            last = next(one for turn in reversed(turns) for one in reversed(turn.pictures))
            if (folder / last.path).read_bytes() == (folder / pictures[0].path).read_bytes():
                (folder / pictures.pop().path).unlink()
        views = info.get("object_views_around", {})
        before = {
            "pictures": pictures,
            "view": [SeenObject.of(one) for one in info["object_views"]],
            "views": {name: [SeenObject.of(one) for one in seen] for name, seen in views.items()},
            "held": info["held"],
            "navigable": list(info["navigable"]),
            "interactable": list(info["interactable"]),
            "at": at,
            "purpose": _purpose(action.verb, info),
            "thoughts": list(_thoughts(turns, info, str(action), action.verb, language)),
            "verb": action.verb,
            "object_type": action.object_type,
        }
        obs, reward, terminated, truncated, info = env.step(action)
        over = terminated or truncated
        if info["action_success"] and action.verb == verbs.NAVIGATE:
            at = action.object_type
        turns.append(
            Turn(
                **before,
                object_id=info["object_id"],
                success=info["action_success"],
                reward=float(reward),
                feedback=info["feedback"],
                fault=info.get("fault", ""),
            )
        )
    record = record_episode(task, agent="expert", seed=seed, max_steps=info["max_steps"])
    return Trajectory(
        id=name,
        task_id=task.id,
        task_type=record.task_type,
        scene=record.scene,
        instruction=record.instruction,
        name=record.name,
        key_actions=record.key_actions,
        search_targets=record.search_targets or [],
        seed=seed,
        part=part,
        kind="anomaly" if part == "anomalies" else "a",
        language=language,
        max_steps=record.max_steps,
        turns=turns,
        success=info["success"],
        end_reason=info["end_reason"],
    )


def _purpose(verb: str, info: Mapping[str, Any]) -> Any:
    if info.get("fault"):
        return "retry"
    return {
        verbs.NAVIGATE: "search",
        verbs.OBSERVE: "look around",
        verbs.MOVE_FORWARD: "get closer",
        verbs.END: "finish",
        verbs.PICKUP: "take",
        verbs.OPEN: "open to look",
        verbs.CLOSE: "close again",
        verbs.PUT: "put",
    }.get(verb, "use")


def _thoughts(
    turns: Sequence[Turn], info: Mapping[str, Any], action: str, verb: str, language: Language
) -> Iterator[ThoughtRecord]:
    seen = info["object_views"][0].object_type if info["object_views"] else "wall"
    kinds: tuple[ThoughtKind, ...] = ("reasoning",)
    if not turns:
        kinds = ("analysis", "planning")
    elif not turns[-1].success:
        kinds = ("reflection",)
    elif verb == verbs.END:
        kinds = ("verification",)
    for kind in kinds:
        text = _WORDS[language][kind].format(seen=seen, action=action)
        text += _STEP[language].format(number=len(turns) + 1)  # no thought is repeated
        yield ThoughtRecord(kind=kind, text=text)
