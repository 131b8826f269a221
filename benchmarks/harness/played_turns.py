"""Turns of real episodes, with what an expert would think about but without thoughts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.mentions import named_in
from er_gym.data.trajectory import Language, Purpose, SeenObject, Subgoal, Turn
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import verbs

SEEDS = (3, 5, 8, 13, 21, 34)
"""Of episodes of the suite mini."""
_PURPOSE: Mapping[str, Purpose] = {
    verbs.NAVIGATE: "search",
    verbs.OPEN: "open to look",
    verbs.CLOSE: "close again",
    verbs.PICKUP: "take",
    verbs.PUT: "put",
    verbs.TOGGLE: "switch",
    verbs.OBSERVE: "look around",
    verbs.MOVE_FORWARD: "get closer",
    verbs.END: "finish",
}


def play(seeds: tuple[int, ...] = SEEDS) -> Iterator[tuple[str, list[Turn]]]:
    """The instruction and the turns of each episode: two wrong places, a failure, a look around,
    then the solver."""
    env = EmbodiedEnv("mini", obs_mode="objects")
    for seed in seeds:
        _, told = env.reset(seed=seed)
        info = with_details(env, told)
        turns: list[Turn] = []
        ended, at = False, ""
        actions = _actions(info)
        action = next(actions)
        while not ended:
            before = dict(info)
            _, reward, terminated, truncated, told = env.step(action)
            info = with_details(env, told)
            turns.append(_turn(before, at, action, float(reward), info))
            if action.verb == verbs.NAVIGATE and info["action_success"]:
                at = action.object_type
            ended = terminated or truncated
            if not ended:
                action = actions.send(info)
        yield info["instruction"], turns
    env.close()


def _actions(info: Any) -> Any:
    """The course of an episode: a generator that is sent each info."""
    wanted = {key.actual_type for key in info["keys_left"] if key.object_id}
    for _ in range(2):
        gone = {each.object_type for each in info["legal"] if each.verb == verbs.NAVIGATE} - wanted
        opens = [each for each in sorted(gone) if verbs.verb_named(verbs.OPEN).takes(each)]
        info = yield Action(verbs.NAVIGATE, (opens or sorted(gone))[0])
        wanted.add((opens or sorted(gone))[0])
        to_open = [each for each in info["legal"] if each.verb == verbs.OPEN]
        if opens and Action(verbs.OPEN, opens[0]) in to_open:
            info = yield Action(verbs.OPEN, opens[0])
            info = yield Action(verbs.CLOSE, opens[0])
    out_of_reach = [
        each
        for each in info["visible"]
        if verbs.verb_named(verbs.PICKUP).takes(each) and each not in info["interactable"]
    ]
    info = yield Action(verbs.PICKUP, next(iter(out_of_reach), _thing(info)))  # fails
    info = yield Action(verbs.OBSERVE)
    solver = Solver()
    while True:
        info = yield solver.next(info)[0]


def _thing(info: Mapping[str, Any]) -> str:
    """What the agent is after."""
    left = info["keys_left"]
    keys = [key for key in left if key.verb in (verbs.PICKUP, verbs.TOGGLE)]
    return keys[0].actual_type if keys else next(iter(named_in(info["instruction"])))


def _turn(info: Mapping[str, Any], at: str, action: Action, reward: float, after: Any) -> Turn:
    return Turn(
        view=[SeenObject.of(each) for each in info["object_views"]],
        views={
            name: [SeenObject.of(each) for each in view]
            for name, view in info["object_views_around"].items()
        },
        held=info["held"],
        navigable=list(info["navigable"]),
        interactable=list(info["interactable"]),
        at=at,
        purpose=_PURPOSE.get(action.verb, "use"),
        subgoal=Subgoal(thing=_thing(info)),
        verb=action.verb,
        object_type=action.object_type,
        object_id=after["object_id"],
        success=after["action_success"],
        reward=max(reward, 0.0),
        feedback=after["feedback"],
    )


def knowledge(seeds: tuple[int, ...] = SEEDS, language: Language = "en") -> list[Knowledge]:
    """What the agent knew at every turn of some episodes."""
    return [
        knowledge_at(turns, index, instruction=instruction, language=language)
        for instruction, turns in play(seeds)
        for index in range(len(turns))
    ]
