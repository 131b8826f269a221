"""The bounds of comparisons: the oracle solves every solvable task, the random agent very few."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from agents import AGENTS, make_agent
from agents.scripted.searcher.agent import StepView
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED, PAPER
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.resolve import resolve_tasks
from er_gym.tasks.suites import load_suite


def play_all(agent: str, tasks, **env_arguments):
    env = EmbodiedEnv([], obs_mode="text", **env_arguments)
    records = []
    for task in tasks:
        seed = episode_seed(0, task.id)
        records.append(play_episode(env, make_agent(agent, seed), task, seed))
    env.close()
    assert [record.error for record in records] == [""] * len(records)
    return records


def test_the_oracle_solves_the_paper_tasks(shared_data) -> None:
    tasks = resolve_tasks(read_tasks(shared_data / "paper_tasks_dev.json")).tasks
    records = play_all("oracle", tasks)
    missed = [r.task_id for r in records if not score_episode(r, CORRECTED).success]
    assert len(missed) <= 0.03 * len(records), missed
    assert [r.success for r in records] == [r.task_id not in missed for r in records]
    uncountable = [
        r.task_id
        for r in records
        if not score_episode(r, PAPER).success and score_episode(r, CORRECTED).success
    ]
    assert uncountable == ["paper-788", "paper-791", "paper-794", "paper-797"]


def test_the_oracle_solves_every_task_of_mini() -> None:
    suite = load_suite("mini")
    records = play_all("oracle", suite.tasks)
    assert [r.task_id for r in records if not score_episode(r, CORRECTED).success] == []


def test_the_random_agent_solves_next_to_nothing() -> None:
    records = play_all("random", load_suite("mini").tasks)
    solved = [r.task_id for r in records if score_episode(r, CORRECTED).success]
    assert len(solved) < 0.05 * len(records), solved


@pytest.mark.parametrize("name", AGENTS.own)
def test_the_same_seed_plays_the_same_episode(name: str) -> None:
    task = load_suite("mini").tasks[0]
    env = EmbodiedEnv([], obs_mode="text")
    first, again = (play_episode(env, make_agent(name, 7), task, 7) for _ in range(2))
    env.close()
    assert [step.text for step in first.steps] == [step.text for step in again.steps]


def test_the_oracle_finds_its_way_without_being_told_where_it_may_go() -> None:
    """The tasks of mini state no navigable objects: it has to look round and walk about."""
    suite = load_suite("mini")
    assert all(task.navigable_objects == () for task in suite.tasks)
    records = play_all("oracle", suite.tasks[:40])
    assert any(step.verb == "observe" for record in records for step in record.steps)


def test_the_mask_reader_goes_from_a_to_z_until_it_reads_what_is_asked_for() -> None:
    tasks = load_suite("mini").tasks[::6]
    records = play_all("mask-reader", tasks)
    assert sum(record.success for record in records) / len(records) > 0.9
    agent = make_agent("mask-reader")
    agent.reset(tasks[0], {}, {})
    agent._view = replace(StepView.of(mask_info()), navigable=("Sofa", "Bed", "Desk", "Mug"))
    assert agent._best_place("Mug", {}) == "Mug"
    assert agent._best_place("Egg", {}) == "Bed"
    assert agent._best_place("Egg", {"Bed": 1}) == "Desk"
    assert agent._best_place("Egg", {"Bed": 2, "Desk": 1, "Mug": 1, "Sofa": 1}) == "Desk"


def mask_info() -> dict[str, Any]:
    env = EmbodiedEnv(obs_mode="text")
    _, info = env.reset(seed=0)
    env.close()
    return info


def test_an_unknown_agent_lists_those_there_are() -> None:
    with pytest.raises(ValueError, match="unknown agent 'genius'; choose one of: oracle, random"):
        make_agent("genius")


@pytest.fixture(scope="module")
def thoughtless() -> dict[str, list[EpisodeRecord]]:
    """The episodes of the agents that cannot think, in a task of each group."""
    tasks = load_suite("mini").tasks[::40]
    names = ("do-nothing", "always-end", "repeat-last", "takes-all", "instruction-blind")
    return {name: play_all(name, tasks) for name in names}


def test_agents_that_cannot_think_do_what_they_are_named_for(
    thoughtless: dict[str, list[EpisodeRecord]],
) -> None:
    verbs = {
        name: {step.verb for record in records for step in record.steps[1:]}
        for name, records in thoughtless.items()
    }
    assert verbs["do-nothing"] == {"observe"}
    assert verbs["always-end"] == {"end"}
    assert {"toggle", "pickup", "put in", "open", "navigate to", "end"} >= verbs["takes-all"]
    assert {"pickup", "end"} <= verbs["takes-all"]
    for record in thoughtless["repeat-last"]:
        said = [step.text for step in record.steps[1:]]
        assert said[0] == said[1] == said[2] != said[3:4]
        assert record.end_reason != "repeated action"
    for record in thoughtless["takes-all"]:
        done = [step.text for step in record.steps[1:]]
        assert len(done) == len({*done})
        assert record.end_reason == "end"
        assert len(record.side_effects or ()) > 1


def test_a_blind_agent_reads_no_instruction() -> None:
    task = load_suite("mini").tasks[0]
    env = EmbodiedEnv([], obs_mode="text")
    played = [
        play_episode(env, make_agent("instruction-blind", 3), replace(task, instruction=text), 3)
        for text in (task.instruction, "Say end.")
    ]
    env.close()
    said, again = ([step.text for step in each.steps] for each in played)
    assert said == again
