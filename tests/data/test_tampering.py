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
from er_gym.data.collection import Collection, CollectionError
from er_gym.data.header_checks import Origin, header_problems
from er_gym.data.trajectory import Correction
from er_gym.rollout import worker_backend
from er_gym.tasks.suites import load_suite

TASKS = load_suite("mini").tasks
RECIPE = Path(__file__).with_name("collected.yaml")
SMALL = ("--width", 96, "--height", 54)
EVERY = {**TAMPERINGS, **MORE}
DECIDED = {
    "another goal",
    "another destination",
    "another plan",
    "a thought of another kind",
    "reasons against a thought",
    "another kind",
    "another mode",
    "another actor",
    "another seed of the collection",
    "an episode once more",
    "an older version of er-gym, and another thought",
    "another package's writer, and another thought",
    "thoughts in another order",
}
"""Tamperings with what nothing tells but the agents, or the settings of the collection."""
MESSAGES = {
    "every turn is learnt, faults too": "turn 0: train is False by the rule of flags, recorded was",
    "another instruction": " in this bedroom and keep it in your hand.' by the task, recorded was",
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


def found(collected: Path, folder: Path, *, agents: bool = True) -> dict[str, str]:
    """What is said of each tampering, on a copy with nothing but the changed trajectory."""
    told = {}
    for name, tamper in EVERY.items():
        loot = Loot.of(shutil.copytree(collected, folder / "x"))
        changed = tamper(loot)
        loot.write(changed)
        try:
            told[name] = "\n".join(problems(loot.folder, TASKS, agents=agents))
        except CollectionError as error:  # of the manifests
            told[name] = str(error)
        shutil.rmtree(loot.folder)
    return told


def test_every_tampering_is_found(collected: Path, tmp_path: Path) -> None:
    told = found(collected, tmp_path)
    assert [name for name in told if not told[name]] == []
    assert len(told) >= 30
    for name, message in MESSAGES.items():
        assert message in told[name], name


def test_who_knows_no_agents_finds_all_but_what_they_decide(
    collected: Path, tmp_path: Path
) -> None:
    told = found(collected, tmp_path, agents=False)
    assert {name for name in told if not told[name]} == DECIDED


HEADERS = {
    "id": ({"id": "FloorPlan1-x"}, "id must begin with that of the task, 'FloorPlan"),
    "kind": ({"kind": "played"}, "kind is a or b or c in the part 'imitation', recorded was 'play"),
    "language": ({"language": "zh"}, "language is 'en' by the collection's settings, recorded"),
    "actor": ({"kind": "model", "actor": "gpt"}, "actor is '' by the collection's settings, reco"),
    "correction": (
        {"correction": Correction(run="attempt", episode="x", first_wrong=0)},
        "correction is Correction(run='attempt', episode='x', first_wrong=0, agent=''), but the "
        "kind is 'b'",
    ),
}


def test_a_header_that_does_not_fit_is_told(collected: Path) -> None:
    collection = Collection.open(collected)
    one = next(collection.trajectories())
    origin = Origin(next(task for task in TASKS if task.id == one.task_id), collection.manifest)
    assert [*header_problems(origin, one)] == []
    for name, (update, message) in HEADERS.items():
        told = "\n".join(header_problems(origin, one.model_copy(update=update)))
        assert message in told, name


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
