"""The environment and the corrected scorer judge alike; the whole of er-1k is judged by
``python -m benchmarks.checks.one_judge``."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from benchmarks.checks.one_judge import PLAYERS, judge_twice
from benchmarks.harness.samples import sample_of_types
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.report import load_run
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.scoring.tables import tables
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks.suites import load_suite
from er_gym.tasks.types import TASK_TYPES

ER_1K = load_suite("er-1k").tasks


@pytest.fixture(scope="module")
def text_env() -> Iterator[EmbodiedEnv]:
    env = EmbodiedEnv([], obs_mode="text")
    yield env
    env.close()


@pytest.mark.parametrize("player", PLAYERS)
def test_env_and_corrected_scorer_agree(text_env: EmbodiedEnv, player: str) -> None:
    tasks = sample_of_types(ER_1K, (), 1)
    assert {task.type for task in tasks} == set(TASK_TYPES)
    judged = [judge_twice(text_env, task, player) for task in tasks]
    assert [(each.record.task_id, each.apart) for each in judged if each.apart] == []


def test_they_agree_under_the_papers_protocol() -> None:
    env = EmbodiedEnv([], obs_mode="text", protocol="paper")
    judged = [judge_twice(env, task, "oracle") for task in sample_of_types(ER_1K, (), 1)[:4]]
    env.close()
    assert [each.apart for each in judged] == [()] * 4


def test_swapped_transfers_are_no_success_to_either(text_env: EmbodiedEnv) -> None:
    all_was_done = 0
    for task in [task for task in ER_1K if task.type.ordered][:4]:
        played = judge_twice(text_env, task, "shuffled oracle")
        did = {(step.verb, step.object_type) for step in played.record.steps if step.success}
        asked = {(key.verb, key.actual_type) for key in task.key_actions if key.scored}
        all_was_done += asked <= did
        assert played.apart == ()
        assert not played.record.success
        assert not score_episode(played.record, CORRECTED).success
    assert all_was_done > 0


def test_put_in_bathtub_is_put_in_its_basin_to_both(text_env: EmbodiedEnv) -> None:
    into_the_tub = ("put in", "BathtubBasin")
    task = next(
        task
        for task in ER_1K
        if into_the_tub in {(key.verb, key.actual_type) for key in task.key_actions}
        and not task.type.ordered
    )
    played = judge_twice(text_env, task, "shuffled oracle")
    assert ("put in", "Bathtub") in {(s.verb, s.object_type) for s in played.record.steps}
    assert played.apart == ()
    assert score_episode(played.record, CORRECTED).success


@pytest.mark.parametrize("player", ["oracle", "random"])
def test_a_search_whose_old_record_does_not_say_for_what(
    text_env: EmbodiedEnv, run_directory: RunDirectory, player: str
) -> None:
    """What was found follows from what the environment said; a report says so in a line."""
    searches = [task for task in ER_1K if task.type.search][:4]
    records = [judge_twice(text_env, task, player).record for task in searches]
    assert all(record.search_targets for record in records)
    old = [record.model_copy(update={"search_targets": None}) for record in records]
    assert [score_episode(r, CORRECTED) for r in old] == [
        score_episode(r, CORRECTED) for r in records
    ]
    for record in old:
        run_directory.write(record)
    overview, *_ = tables([load_run(run_directory.path)])
    assert f"{run_directory.path}: 4 of 4 episodes are searches whose old records" in str(
        overview.notes
    )
