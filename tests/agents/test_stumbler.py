"""The stumbler plays as the searcher does, with mistakes that the environment refuses."""

from __future__ import annotations

from itertools import groupby

from agents import make_agent
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.tasks.suites import load_suite

SEEDS = range(4)


def action(step: StepRecord) -> tuple[str, str]:
    return step.verb, step.object_type


def done(episode: EpisodeRecord) -> list[tuple[str, str]]:
    return [action(step) for step in episode.steps[1:] if step.success]


def play(env: EmbodiedEnv, agent: str, task: object, seed: int) -> EpisodeRecord:
    return play_episode(env, make_agent(agent, seed), task, seed)  # type: ignore[arg-type]


def test_mistakes_are_refused_and_the_rest_is_what_the_searcher_does() -> None:
    env = EmbodiedEnv([], obs_mode="text", instances="explore")
    mistakes = runs = repeated = 0
    for task in load_suite("mini").tasks[::11]:
        plain = play(env, "searcher", task, 0)
        for seed in SEEDS:
            episode = play(env, "stumbler", task, seed)
            # Mistakes cost steps, so a long search may end earlier.
            if episode.success and plain.success:
                assert done(episode) == done(plain), (task.id, seed)
            refused = [not step.success for step in episode.steps[1:]]
            lengths = [len([*group]) for wrong, group in groupby(refused) if wrong]
            assert max(lengths, default=0) <= 2
            mistakes, runs = mistakes + sum(lengths), runs + len(lengths)
            repeated += sum(
                action(one) == action(next_one) and not next_one.success
                for one, next_one in zip(episode.steps, episode.steps[1:], strict=False)
            )
    env.close()
    assert mistakes > runs > 20
    assert repeated
