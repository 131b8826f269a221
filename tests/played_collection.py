"""Makes a collection of real episodes, with plain thoughts, for tests that read collections.

The solver plays them. In the part ``anomalies`` things go wrong. In the part ``mixed`` the agent
first tries what is not legal, in every third episode; so a turn without a picture follows, and the
turn of that mistake is not learnt. In every second it looks around, and every fourth is in Chinese.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from er_gym.data.collection import PARTS, Collection, CollectionManifest
from er_gym.data.pictures import encode_picture
from er_gym.data.train_rule import learnt
from er_gym.data.trajectory import (
    Language,
    PictureRecord,
    SeenObject,
    ThoughtKind,
    ThoughtRecord,
    Trajectory,
    Turn,
)
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import action_of, with_details
from er_gym.envs.solver import Solver
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import record_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task
from er_gym.writing import file_stem

SUITE = load_suite("mini")
FAULTS = {"anomalies": 0.4}
_KINDS = {"imitation": "a", "anomalies": "anomaly", "mixed": "played"}
_ILLEGAL = Action(verbs.CLOSE, "Fridge")
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


@dataclass(frozen=True)
class Played:
    """An episode to be played.

    Attributes:
        task: the task.
        first: what the agent does before it does the task.
        language: of the thoughts.
    """

    task: Task
    first: tuple[Action, ...] = ()
    language: Language = "en"


def _episodes(part: str, language: Language) -> list[Played]:
    tasks = SUITE.tasks
    if part == "mixed":
        return [
            Played(
                task,
                (
                    *(() if number % 3 else (_ILLEGAL,)),
                    *((Action(verbs.OBSERVE),) if number % 2 else ()),
                ),
                "zh" if number % 4 == 3 else "en",
            )
            for number, task in enumerate(tasks[:: len(tasks) // 12][:12])
        ]
    places = {"imitation": (0, 24, 48, 60), "anomalies": (61, 96, 108)}[part]
    return [Played(tasks[place], language=language) for place in places]


def make_collection(
    path: Path,
    *,
    parts: Sequence[str] = ("imitation", "anomalies"),
    width: int = 160,
    height: int = 90,
    language: Language = "en",
) -> Collection:
    """Play the episodes of some parts, and write what was seen, said and done."""
    manifest = CollectionManifest(
        suite=SUITE.name, suite_digest=SUITE.digest, seed=3, er_gym="0.1.0"
    )
    collection = Collection.create(path, manifest)
    found: list[Trajectory] = []
    for part in parts:
        env: dict[str, Any] = {"obs_mode": "rgb+objects", "width": width, "height": height}
        if part in FAULTS:
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
        found += [_played(made, each, part, path) for each in _episodes(part, language)]
        made.close()
    collection.write(found)
    return collection


def _played(env: EmbodiedEnv, episode: Played, part: str, folder: Path) -> Trajectory:
    task = episode.task
    name = f"{task.id}~a"
    seed = episode_seed(3, name)
    obs, told = env.reset(seed=seed, options={"task": task})
    info = with_details(env, told)
    place = f"{PARTS}/{part}/pictures/{file_stem(name)}"
    solver, todo, at, over = Solver(), [*episode.first], "", False
    turns: list[Turn] = []
    while not over:
        action = action_of(info) if info["fault"] else todo.pop(0) if todo else solver.next(info)[0]
        views = info["object_views_around"]
        before = {
            "pictures": _pictures(folder, place, turns, obs, info),
            "view": [SeenObject.of(one) for one in info["object_views"]],
            "views": {name: [SeenObject.of(one) for one in seen] for name, seen in views.items()},
            "held": info["held"],
            "navigable": list(info["navigable"]),
            "interactable": list(info["interactable"]),
            "at": at,
            "purpose": _purpose(action.verb, info),
            "thoughts": list(_thoughts(turns, info, str(action), action.verb, episode.language)),
            "verb": action.verb,
            "object_type": action.object_type,
        }
        obs, reward, terminated, truncated, told = env.step(action)
        info = with_details(env, told)
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
                fault=info["fault"],
            )
        )
    record = record_episode(task, agent="expert", seed=seed, max_steps=info["max_steps"])
    found = Trajectory(
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
        kind=_KINDS[part],
        language=episode.language,
        max_steps=record.max_steps,
        turns=turns,
        success=info["success"],
        end_reason=info["end_reason"],
    )
    flags = zip(turns, learnt(found), strict=True)
    learnable = [turn.model_copy(update={"train": train}) for turn, train in flags]
    return found.model_copy(update={"turns": learnable})


def _pictures(
    folder: Path, place: str, turns: Sequence[Turn], obs: Mapping[str, Any], info: Mapping[str, Any]
) -> list[PictureRecord]:
    """Write the pictures of a turn; none after an action that failed and changed nothing."""
    (folder / place).mkdir(parents=True, exist_ok=True)
    before = [one for turn in turns for one in turn.pictures]
    records: list[PictureRecord] = []
    for direction, frame in (info["views"] or {"ahead": obs["rgb"]}).items():
        data = encode_picture(frame)
        failed = bool(turns) and not turns[-1].success and direction == "ahead"
        if failed and (folder / before[-1].path).read_bytes() == data:
            continue
        path = f"{place}/{len(before) + len(records):03}.jpeg"
        (folder / path).write_bytes(data)
        high, wide, _ = frame.shape
        records.append(PictureRecord(path=path, direction=direction, width=wide, height=high))
    return records


def _purpose(verb: str, info: Mapping[str, Any]) -> Any:
    if info["fault"]:
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
