"""Whoever poisons a collection is found by ``er-gym data verify``; what nobody touched is not."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from tamperings import MORE, TAMPERINGS, Loot
from verified import problems

from benchmarks.cli.main import cli
from er_gym.data.collection import CollectionError
from er_gym.rollout import worker_backend
from er_gym.tasks.suites import load_suite

TASKS = load_suite("mini").tasks
RECIPE = Path(__file__).with_name("collected.yaml")
SMALL = ("--width", 96, "--height", 54)
MESSAGES = {
    "every turn is learnt, faults too": "turn 0: train is False by the rule of flags, recorded was",
    "another instruction": "instruction is 'We are going to need a Pen. Search the bedroom, and",
    "a key action less": "key_actions[0].verb is 'navigate to' by the task, recorded was 'pickup'",
    "another task type": "task_type is 'single_pickup' by the task, recorded was 'pickup_and_put'",
    "another seed": "by the collection's seed and the id, recorded was",
    "no pictures at one turn": "turn 1: the directions of pictures[0] is 'ahead', recorded was",
    "a tiny picture": "000.jpeg is written otherwise: its size is 16 x 9, not 96 x 54",
    "an object on another side": "turn 0: view[0].side is 'right', recorded was 'left'",
    "another goal": "turn 0: subgoal.thing is 'Pen' by the seed, played anew, recorded was 'Safe'",
    "another plan": "turn 0: plan[1] is nothing by the seed, played anew, recorded was 'Safe'",
    "another mode": "mode is 'search' by the seed and the settings, recorded was ''",
    "another first mistake": "correction.first_wrong is 0 by the rewards, recorded was 1",
    "a part without faults": "run.json: env['faults'] is {'navigate': 0.3, ",
    "no record of the part": "the part's own record of it, cannot be read: ",
}
"""What is said of some tamperings: the turn, the field, both values, and what says so."""


def er_gym(*words: object) -> None:
    """Run a command in this process."""

    def run_here(make: Any, jobs: Iterable[Any], **how: Any) -> Iterator[tuple[Any, Any]]:
        worker = make()
        yield from ((job, worker(job)) for job in jobs)
        worker.close()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker_backend, "run_jobs", run_here)
        told = CliRunner().invoke(cli, [str(word) for word in words], standalone_mode=False)
    assert told.exception is None, told.output
    assert not told.return_value, told.output


@pytest.fixture(scope="module")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("collected") / "x"
    er_gym("collect", "--suite", "mini", "--recipe", RECIPE, "--out", out, "--workers", 1, *SMALL)
    return out


def test_what_nobody_touched_comes_out_again(collected: Path) -> None:
    assert problems(collected, TASKS) == []
    assert problems(collected, TASKS, pictures=False) == []


def test_every_tampering_is_found(collected: Path, tmp_path: Path) -> None:
    """Each on a copy that holds nothing but the changed trajectory."""
    every = {**TAMPERINGS, **MORE}
    found = {}
    for name, tamper in every.items():
        copy = tmp_path / "x"
        shutil.copytree(collected, copy)
        loot = Loot.of(copy)
        loot.write(tamper(loot))
        try:
            found[name] = "\n".join(problems(copy, TASKS))
        except CollectionError as error:  # of the manifests
            found[name] = str(error)
        shutil.rmtree(copy)
    assert [name for name, told in found.items() if not told] == []
    assert len(every) >= 30
    for name, message in MESSAGES.items():
        assert message in found[name], name


def test_a_trajectory_that_is_there_twice_is_found(collected: Path, tmp_path: Path) -> None:
    copy = shutil.copytree(collected, tmp_path / "x")
    loot = Loot.of(copy)
    loot.write(loot.one(), loot.one())
    with pytest.raises(CollectionError, match="is there twice"):
        problems(copy, TASKS)


def test_chinese_without_pictures_comes_out_again(tmp_path: Path) -> None:
    more = ("--limit", 3, "--language", "zh", "--no-pictures", "--workers", 1)
    er_gym("collect", "--suite", "mini", "--recipe", RECIPE, "--out", tmp_path, *more)
    assert problems(tmp_path, TASKS) == []


def test_episodes_of_the_papers_protocol_come_out_again(tmp_path: Path) -> None:
    run, selected, other, corrected = (tmp_path / name for name in "abcd")
    ids = [task.id for task in TASKS if task.type.name == "single_pickup"][:2]
    chosen = ("--suite", "mini", "--task-ids", ",".join(ids), "--protocol", "paper")
    er_gym("bench", *chosen, "--agent", "searcher", "--out", run)
    er_gym("collect", "--select", run, "--out", selected, "--workers", 1, *SMALL)
    assert problems(selected, TASKS) == []
    er_gym("bench", *chosen, "--agent", "random", "--out", other)
    er_gym("collect", "--correct", other, "--out", corrected, "--workers", 1, *SMALL)
    assert problems(corrected, TASKS) == []
