"""Corrections in which another agent takes over: a searcher, or a policy of the zoo."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace

import pytest
from expert_courses import SEED, TASKS, NotedCourse, environment, of_each_type, play

from agents.expert.corrections import Beginning, first_mistake
from agents.expert.prescreen import SilentAgent
from agents.expert.recipe import load_recipe
from agents.expert.recorder import joined_modes
from agents.expert.successors import (
    PolicyTakesOver,
    RecordedTakesOver,
    check_corrector,
    goals_left,
    successor,
)
from agents.expert.takeover import TakeoverCourse
from agents.scripted.searcher import instruction as words
from agents.scripted.searcher.instruction import Goal
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import KeyAction

RECIPE = load_recipe()
EXPERTS = RECIPE.parts["imitation"]


@pytest.fixture(scope="module")
def env() -> Iterator[EmbodiedEnv]:
    env = environment()
    yield env
    env.close()


@pytest.mark.parametrize("searcher", ["searcher", "spotter"])
def test_a_searcher_takes_over_a_failed_episode(env: EmbodiedEnv, searcher: str) -> None:
    part = RECIPE.parts["corrections"]
    corrected, as_the_searcher = 0, searcher == "spotter"
    for candidate in of_each_type(part, 4):
        failed = play(env, candidate)
        beginning = first_mistake(failed.episode, "failure")
        if beginning.problem:
            continue
        taken_over = replace(candidate, beginning=beginning, strength=None, correct_by=searcher)
        one = play(env, taken_over)
        if as_the_searcher:
            other = play(env, replace(taken_over, correct_by="searcher"))
            as_the_searcher = one.intents == other.intents
        cut = len(beginning.actions)
        assert tuple(intent.action for intent in one.intents[:cut]) == beginning.actions
        assert not any(intent.train for intent in one.intents[:cut])
        assert all(intent.train for intent in one.intents[cut:])
        for intent in one.intents[cut:]:  # what is held is carried to its place and nowhere else
            if intent.purpose == "carry" and intent.subgoal.thing:
                place = intent.subgoal.place or intent.subgoal.thing
                assert same_type(intent.action.object_type, place), intent
        if one.problem:
            continue
        assert one.episode.success
        corrected += 1
    assert corrected > 8
    assert not as_the_searcher


def test_a_policy_goes_on_from_its_own_beginning_as_it_would_have() -> None:
    """So it has seen all that the episode saw before it takes over."""
    pytest.importorskip("torch")
    name = "zoo:all-sightings"
    policy = successor(name)
    assert isinstance(policy, PolicyTakesOver)
    modes = joined_modes(SilentAgent.obs_mode, policy.observes)
    took_over = 0
    with closing(environment(obs_mode=modes)) as env:
        for candidate in of_each_type(EXPERTS, 1):
            seed = episode_seed(SEED, candidate.id)
            whole = play_episode(env, policy.policy, candidate.played_task, seed)
            actions = [Action(step.verb, step.object_type) for step in whole.steps[1:]]
            begun = Beginning(tuple(actions[: len(actions) // 2]))
            one = play(env, replace(candidate, beginning=begun, correct_by=name))
            assert [intent.action for intent in one.intents] == actions
            assert [intent.train for intent in one.intents] == [
                index >= len(begun.actions) for index in range(len(actions))
            ]
            took_over += len(begun.actions) > 2
    assert took_over > 5


def test_who_takes_over_and_tries_again_what_was_refused_means_to(env: EmbodiedEnv) -> None:
    beginning, refused = Action(verbs.OBSERVE), Action(verbs.PICKUP, "Safe")
    actions = [refused, refused, Action(verbs.OBSERVE), refused, Action(verbs.END)]
    course = TakeoverCourse(TASKS[0], [beginning], RecordedTakesOver(actions))
    noted = NotedCourse(course)
    play_episode(env, SilentAgent(noted), TASKS[0], SEED)
    intents = [intent for intent, _ in noted.noted]
    assert [intent.action for intent in intents] == [beginning, *actions]
    assert [intent.purpose == "retry" for intent in intents] == [False] * 2 + [True] + [False] * 3


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("spoter", "give expert, searcher, spotter, or zoo:NAME"),
        ("zoo:all-sighting", "did you mean all-sightings"),
        ("zoo:er-tiny-vl", "it is a language model, not a policy"),
    ],
)
def test_who_cannot_take_over_is_told(name: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        check_corrector(name)


def test_the_searcher_leaves_alone_what_is_done(env: EmbodiedEnv) -> None:
    part = EXPERTS.model_copy(update={"kinds": {"b": 1.0}})
    corrected = 0
    for candidate in of_each_type(part, 8):
        right = play(env, candidate)
        actions = [intent.action for intent in right.intents]
        puts = [index for index, action in enumerate(actions) if action.verb == verbs.PUT]
        if right.problem or len(puts) < 2:
            continue
        begun = (*actions[: puts[0] + 1], Action(verbs.OBSERVE))
        kind = {"kind": "corrected", "mode": "", "correct_by": "searcher"}
        one = play(env, replace(candidate, beginning=Beginning(begun), **kind))
        if not one.problem:
            corrected += 1
            taken = [step.object_id for step in one.episode.steps if step.verb == verbs.PICKUP]
            assert len(taken) == len(set(taken))
    assert corrected > 2


GOALS = [
    Goal(words.PUT, "Mug", "Shelf"),
    Goal(words.PUT, "Cup", "Shelf"),
    Goal(words.TOGGLE, "DeskLamp"),
    Goal(words.FIND, "Book"),
]


@pytest.mark.parametrize(
    ("done", "left"),
    [
        ([], GOALS),
        ([(verbs.PICKUP, "Mug")], GOALS),
        ([(verbs.PICKUP, "Mug"), (verbs.PUT, "Shelf")], GOALS[1:]),
        ([(verbs.PUT, "Shelf"), (verbs.PUT, "Shelf")], GOALS[2:]),
        ([(verbs.TOGGLE, "DeskLamp"), (verbs.NAVIGATE, "Book")], [*GOALS[:2], GOALS[3]]),
    ],
)
def test_goals_are_reached_by_their_last_key_actions(
    done: list[tuple[str, str]], left: list[Goal]
) -> None:
    keys = [KeyAction(verb, object_type=name) for verb, name in done]
    assert goals_left(GOALS, keys) == left
