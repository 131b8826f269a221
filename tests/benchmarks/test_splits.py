"""Success by how new the tasks are."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from benchmarks.scoring.report import load_run
from benchmarks.scoring.splits import (
    SPLITS,
    STRICT,
    WORDINGS,
    split_of_episode,
    split_results,
)
from er_gym.rollout.records import record_episode
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.tasks.splits import is_strictly_unseen, split, subject_types, wording
from er_gym.tasks.suites import load_suite


@pytest.mark.parametrize("suite", ["mini", "er-1k"])
def test_a_record_is_of_the_split_of_its_task(suite: str) -> None:
    tasks = load_suite(suite).tasks
    told = [split_of_episode(record_episode(task, agent="x", seed=0)) for task in tasks]
    assert told == [split(task) for task in tasks]
    assert set(told) <= set(SPLITS)


def test_every_episode_is_in_one_row(tmp_path: Path) -> None:
    tasks = load_suite("er-1k").tasks[::25]
    manifest = Manifest(
        suite="er-1k", suite_digest="x", suite_size=1000, agent="x", env={}, seed=0, er_gym="0"
    )
    run = RunDirectory.create(tmp_path / "run", manifest)
    for task in tasks:
        run.write(record_episode(task, agent="x", seed=0, end_reason="end"))
    rows = split_results([load_run(run.path)])
    counts = Counter(map(split, tasks))
    told = Counter(f"{wording(task)} wording" for task in tasks)
    strict = Counter(STRICT for task in tasks if is_strictly_unseen(subject_types(task)))
    every = counts + told + strict
    assert {row.split: row.summary.n for row in rows} == dict(every)
    names = (*SPLITS, STRICT, *WORDINGS.values())
    assert [row.split for row in rows] == [name for name in names if name in every]
    assert min(map(len, (counts, told))) > 1
    assert strict
