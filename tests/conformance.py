"""What every plug is compared with: 200 texts of actions in 40 tasks of all types, as
``gymnasium.make`` answers them.

A plug is driven by an adapter of a few lines, a :class:`Player`. ``benchmarks/checks`` drives those
whose library needs an environment of its own with the same texts.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Protocol

import gymnasium

import er_gym  # noqa: F401  (it registers the environments)
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

SETTINGS: dict[str, Any] = {"episode_source": "er-1k", "max_steps": 9}
"""Of the environment; within so few steps some tasks cannot be solved, and are cut."""
TASKS, TEXTS = 40, 200
_SCENES = ("FloorPlan1", "FloorPlan2", "FloorPlan302")
"""Rooms that have tasks of all types; few, since loading a room takes longer than a course."""
_UNREADABLE = (
    "fetch me a coffee",
    "",
    "<action>open Fridge</action>",
    "7",
    "navigate to",
    "ü" * 300,
)


@dataclass(frozen=True)
class Answer:
    """What ``reset`` or a step answers, as far as every plug can tell it."""

    text: str
    reward: float
    done: bool
    success: bool


@dataclass(frozen=True)
class Course:
    """The texts that are said in a task, and the answers: that of ``reset``, then one a text."""

    task_id: str
    texts: tuple[str, ...]
    answers: tuple[Answer, ...]


class Player(Protocol):
    """Plays tasks by way of a plug, in environments of :data:`SETTINGS`."""

    def reset(self, task_id: str) -> Answer: ...

    def step(self, text: str) -> Answer: ...


def reply(text: str) -> str:
    """A model's reply whose action is a text, in a tag that no text of the courses has."""
    return f"<think>Hm.</think><DecisionMaking>{text}</DecisionMaking>"


def differences(player: Player, courses: Sequence[Course]) -> list[str]:
    """Where a plug answers otherwise than ``gymnasium.make``: a line for each course's first."""
    found = []
    for course in courses:
        told = [player.reset(course.task_id), *map(player.step, course.texts)]
        said = ("(reset)", *course.texts)
        for text, is_, should in zip(said, told, course.answers, strict=True):
            if is_ != should:
                found.append(f"{course.task_id}, {text!r:.60}: {is_} instead of {should}")
                break
    return found


@cache
def all_courses() -> tuple[Course, ...]:
    """40 courses in tasks of all types, 200 texts in all, as ``gymnasium.make`` answers them."""
    tasks = dict(enumerate(_tasks()))
    kinds = {number: list(_KINDS)[number % len(_KINDS)] for number in tasks}
    played = {
        number: _played(task, _KINDS[kinds[number]](random.Random(number)))
        for number, task in tasks.items()
        if kinds[number] != _WANDER
    }
    wandering = tasks.keys() - played.keys()
    rest = TEXTS - sum(len(course.texts) for course in played.values())
    for place, number in enumerate(sorted(wandering)):
        texts = rest // len(wandering) + (place < rest % len(wandering))
        played[number] = _played(tasks[number], _wander(random.Random(number)), texts)
    return tuple(played[number] for number in sorted(tasks))


def _tasks() -> list[Task]:
    """40 tasks, each type in turn in each of the rooms."""
    by_kind: dict[tuple[str, str], list[Task]] = {}
    for task in load_suite(SETTINGS["episode_source"]).tasks:
        if task.scene in _SCENES:
            by_kind.setdefault((task.scene, task.type.name), []).append(task)
    first, second = ([tasks[place] for tasks in by_kind.values()] for place in (0, 1))
    return [*first, *second][:TASKS]


Says = Callable[[dict[str, Any]], str]
"""What is said next, by ``info`` with the environment's details."""


def _solve(dice: random.Random) -> Says:
    solver = Solver()
    return lambda info: str(solver.next(info)[0])


def _babble(dice: random.Random) -> Says:
    texts = iter(dice.sample(_UNREADABLE, len(_UNREADABLE)))
    return lambda info: next(texts)


def _insist(dice: random.Random) -> Says:
    said: list[str] = []

    def says(info: dict[str, Any]) -> str:
        said.append(said[-1] if said else str(dice.choice(info["legal"][1:])))
        return said[-1]

    return says


def _give_up(dice: random.Random) -> Says:
    texts = iter(("open Safe", dice.choice(_UNREADABLE), " Go To  fridge", "observe", "end"))
    return lambda info: next(texts)


def _wander(dice: random.Random) -> Says:
    def says(info: dict[str, Any]) -> str:
        return str(dice.choice([each for each in info["legal"] if str(each) != "end"]))

    return says


_KINDS: dict[str, Callable[[random.Random], Says]] = {
    "solve": _solve,
    "babble": _babble,
    "insist": _insist,
    "give up": _give_up,
    "wander": _wander,
}
"""The kinds of courses. Wanderers share what texts the others leave."""
_WANDER = "wander"


def _played(task: Task, says: Says, most: int = TEXTS) -> Course:
    env = gymnasium.make(task.type.env_id, obs_mode="text", **SETTINGS)
    obs, info = env.reset(options={"task": task.id})
    texts: list[str] = []
    answers = [Answer(obs["text"], 0.0, False, False)]
    while len(texts) < most and not answers[-1].done:
        texts.append(says(with_details(env, info)))
        obs, reward, terminated, truncated, info = env.step(texts[-1])
        answers.append(Answer(obs["text"], float(reward), terminated or truncated, info["success"]))
    env.close()
    return Course(task.id, tuple(texts), tuple(answers))
