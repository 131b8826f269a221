"""Episodes with searches, detours and failed actions, as turns that a writer of thoughts is given.

A simple player for checks and tests: the solver's actions, with wrong places before the right one,
looks around, needless repeats, and actions that fail once.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from agents.expert.writers.base import ThoughtRequest, ThoughtWriter
from er_gym import EmbodiedEnv
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import (
    Language,
    Purpose,
    SeenObject,
    Subgoal,
    ThoughtKind,
    ThoughtRecord,
    Turn,
)
from er_gym.envs.actions import Action
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import verbs
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import KeyAction, Task
from er_gym.thor import OBJECT_TYPES

_FAULTS, _REPEATS, _LOOKS = 0.06, 0.03, 0.1
_MOST_TURNS = 40
_PURPOSE_OF: Mapping[str, Purpose] = {
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "get closer",
    verbs.CLOSE: "close again",
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.TOGGLE: "switch",
    verbs.END: "finish",
}


@dataclass
class _Player:
    """Plays one episode; ``turns`` grows as it goes."""

    env: EmbodiedEnv
    seed: int
    turns: list[Turn] = field(default_factory=list)

    def play(self, task: Task) -> list[Turn]:
        self.random = random.Random(self.seed)
        self.solver, self.at = Solver(), ""
        _, info = self.env.reset(seed=self.seed, options={"task": task})
        self.info = with_details(self.env, info)
        wrong: list[str] = []
        target: KeyAction | None = None
        checked = False
        while len(self.turns) < _MOST_TURNS:
            action, key = self.solver.next(self.info)
            purpose, subgoal = self._meaning(action, task)
            if purpose == "search" and key is not target:
                target = key
                wrong = self._wrong_places(action.object_type)
                if self.random.random() < _LOOKS:
                    self._step(Action(verbs.OBSERVE), "look around", subgoal, [])
            while purpose == "search" and wrong and not self._sees(subgoal.thing):
                place = wrong[0]
                if place not in self.info["navigable"]:
                    wrong.pop(0)
                    continue
                self._step(
                    Action(verbs.NAVIGATE, place), purpose, subgoal, [*wrong, action.object_type]
                )
                wrong.pop(0)
                if Action(verbs.OPEN, place) in self.info["legal"]:
                    later = [*wrong, action.object_type]
                    self._step(Action(verbs.OPEN, place), "open to look", subgoal, later)
                    self._step(Action(verbs.CLOSE, place), "close again", subgoal, later)
            if action.verb == verbs.END and not checked and self.random.random() < 0.2:
                checked = True
                self._step(Action(verbs.MOVE_FORWARD), "check", subgoal, [])
                continue
            plan = [action.object_type] if purpose == "search" else []
            if self._step(action, purpose, subgoal, plan):
                break
        return self.turns

    def _meaning(self, action: Action, task: Task) -> tuple[Purpose, Subgoal]:
        """Why the action is taken, and what the agent is after."""
        info, held = self.info, self.info["held"]
        left = [key for key in info["keys_left"] if key.verb != verbs.END]
        acts = [k for k in left if k.verb not in (verbs.NAVIGATE, verbs.OPEN, verbs.CLOSE)]
        put = next((k.actual_type for k in acts if k.verb == verbs.PUT), "")
        if held:
            subgoal = Subgoal(verb=verbs.PUT, thing=held, place=put)
        elif acts:
            verb = "find" if acts[0].verb == verbs.PICKUP else acts[0].verb
            subgoal = Subgoal(verb=verb, thing=acts[0].actual_type, place=put)
        elif self.turns and self.turns[-1].subgoal.thing:
            subgoal = self.turns[-1].subgoal
        else:
            subgoal = Subgoal(thing=next(iter(task_targets(task)), ""))
        if action.verb == verbs.NAVIGATE:
            if held:
                return "carry", subgoal
            seen = {each.object_type for each in info["object_views"]}
            return ("approach" if subgoal.thing in seen else "search"), subgoal
        if action.verb == verbs.OPEN:
            return ("open to put" if held else "open to look"), subgoal
        return _PURPOSE_OF.get(action.verb, "use"), subgoal

    def _sees(self, kind: str) -> bool:
        return any(each.object_type == kind for each in self.info["object_views"])

    def _wrong_places(self, right: str) -> list[str]:
        places = [
            name
            for name in self.info["navigable"]
            if "receptacle" in OBJECT_TYPES[name].properties
            and "pickupable" not in OBJECT_TYPES[name].properties
            and name != right
        ]
        count = self.random.choice((0, 1, 1, 2))
        return self.random.sample(places, min(count, len(places)))

    def _step(self, action: Action, purpose: Purpose, subgoal: Subgoal, plan: list[str]) -> bool:
        """Take an action, perhaps after it failed once, perhaps twice; whether it is over."""
        can_fail = action.verb not in (verbs.END, verbs.OBSERVE, verbs.MOVE_FORWARD)
        if can_fail and self.random.random() < _FAULTS:
            self._record(action, purpose, subgoal, plan, fault=action.verb)
            purpose = "retry"
        over = self._record(action, purpose, subgoal, plan)
        if can_fail and not over and self.random.random() < _REPEATS:
            self._record(action, "repeat", subgoal, plan, fault="")
        return over

    def _record(
        self,
        action: Action,
        purpose: Purpose,
        subgoal: Subgoal,
        plan: list[str],
        fault: str | None = None,
    ) -> bool:
        info = self.info
        around = info["object_views_around"]
        turn = Turn(
            view=[SeenObject.of(each) for each in info["object_views"]],
            views={way: [SeenObject.of(one) for one in view] for way, view in around.items()},
            held=info["held"],
            navigable=list(info["navigable"]),
            interactable=list(info["interactable"]),
            at=self.at,
            purpose=purpose,
            subgoal=subgoal,
            plan=plan,
            verb=action.verb,
            object_type=action.object_type,
        )
        if fault is not None:  # nothing happens
            result = {"success": not fault, "fault": fault, "feedback": "It failed."}
            self.turns.append(turn.model_copy(update=result))
            return False
        _, reward, terminated, truncated, told = self.env.step(action)
        self.info = with_details(self.env, told)
        success = self.info["action_success"]
        if success and action.verb == verbs.NAVIGATE:
            self.at = action.object_type
        result = {
            "success": success,
            "reward": reward,
            "feedback": self.info["feedback"],
            "object_id": self.info["object_id"],
        }
        self.turns.append(turn.model_copy(update=result))
        return terminated or truncated


def task_targets(task: Task) -> list[str]:
    """The object types that the instruction names, as written in it."""
    return [kind for kind in OBJECT_TYPES if kind in task.instruction.replace(".", " ").split()]


def turns_of(env: EmbodiedEnv, task: Task, seed: int) -> list[Turn]:
    """The turns of an episode, without thoughts."""
    return _Player(env, seed).play(task)


def kinds_at(turns: list[Turn], index: int, choices: random.Random) -> tuple[ThoughtKind, ...]:
    """The kinds of a turn's thoughts, roughly as an expert would draw them."""
    turn, draw = turns[index], choices.random()
    if index == 0:
        return ("analysis", "planning") if draw < 0.6 else ("analysis", "reasoning", "planning")
    before = turns[index - 1]
    if turn.purpose == "finish":
        return ("reasoning",) if draw < 0.6 else ("reasoning", "verification")
    if turn.purpose == "check":
        return ("reasoning", "verification") if draw < 0.5 else ("verification",)
    if not before.success or before.purpose in ("repeat", "look around"):
        return ("reflection",) if draw < 0.6 else ("reflection", "planning")
    if before.purpose in ("search", "open to look") and not before.earned:
        return ("reflection",) if draw < 0.6 else ("reflection", "planning")
    return (
        ("reasoning",) if draw < 0.5 else ("planning",) if draw < 0.8 else ("reasoning", "planning")
    )


def written(
    writer: ThoughtWriter, turns: list[Turn], instruction: str, language: Language, seed: int
) -> Iterator[tuple[ThoughtRequest, tuple[ThoughtRecord, ...]]]:
    """Write the thoughts of an episode turn by turn; each turn knows the thoughts before it."""
    choices, so_far = random.Random(seed), list[Turn]()
    for index, turn in enumerate(turns):
        kinds = kinds_at(turns, index, choices)
        knowledge = knowledge_at([*so_far, turn], index, instruction=instruction, language=language)
        limits = (150,) * len(kinds)
        request = ThoughtRequest(knowledge, kinds, limits, seed=seed * 1000 + index)
        thoughts = writer.write(request).thoughts
        so_far.append(turn.model_copy(update={"thoughts": list(thoughts)}))
        yield request, thoughts


def played(count: int, seed: int, suite: Any = "train") -> Iterator[tuple[Task, list[Turn]]]:
    """Episodes of tasks drawn from a suite."""
    tasks = random.Random(seed).sample(list(load_suite(suite).tasks), count)
    env = EmbodiedEnv(suite, obs_mode="objects")
    try:
        for number, task in enumerate(tasks):
            yield task, turns_of(env, task, seed + number)
    finally:
        env.close()
