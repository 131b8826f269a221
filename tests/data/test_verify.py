"""Verification: what was recorded comes out again, and whatever was changed is found."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from played_collection import SUITE, make_collection

from er_gym.data import critic, verify
from er_gym.data.collection import Collection, CollectionError
from er_gym.data.course_checks import course_problems
from er_gym.data.critic import Refusal
from er_gym.data.line_index import lines_of
from er_gym.data.trajectory import Trajectory
from er_gym.rollout import worker_backend
from er_gym.tasks.suites import load_suite


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> Collection:
    return make_collection(tmp_path_factory.mktemp("data") / "x")


@pytest.fixture
def collection(played: Collection, tmp_path: Path) -> Collection:
    """A copy that a test may damage."""
    return Collection.open(shutil.copytree(played.path, tmp_path / "x"))


@pytest.fixture
def verdicts(monkeypatch: pytest.MonkeyPatch) -> Callable[..., dict[str, verify.Verdict]]:
    """Verifies in this process, and returns the verdicts by id."""

    def run_here(make: Any, jobs: Iterable[Any], **how: Any) -> Iterator[tuple[Any, Any]]:
        worker = make()
        yield from ((job, worker(job)) for job in jobs)
        worker.close()

    monkeypatch.setattr(worker_backend, "run_jobs", run_here)

    def run(collection: Collection, **options: Any) -> dict[str, verify.Verdict]:
        return {one.id: one for one in verify.verify(collection, SUITE.tasks, **options)}

    return run


def changed(collection: Collection, index: int, change: Callable[[dict[str, Any]], None]) -> str:
    """Change the record of one trajectory; its id."""
    every = [one.model_dump() for one in collection.trajectories()]
    change(every[index])
    collection.write(Trajectory.model_validate(one) for one in every)
    return str(every[index]["id"])


def problem_of(found: dict[str, verify.Verdict]) -> tuple[str, str]:
    """The one verdict with a problem, and that problem."""
    (wrong,) = (one for one in found.values() if one.problems)
    (problem,) = wrong.problems
    return wrong.id, problem


def test_what_was_played_comes_out_again_in_two_processes(played: Collection) -> None:
    found = list(verify.verify(played, SUITE.tasks, workers=2))
    assert [one.problems for one in found] == [()] * 7
    every = list(played.trajectories())
    assert {one.id for one in found} == {one.id for one in every}
    assert sum(one.turns for one in found) == sum(one.actions for one in every)
    assert sum(one.pictures for one in found) == sum(one.pictures for one in every)
    faults = [turn.fault for one in every for turn in one.turns if turn.fault]
    assert len(faults) > 5
    assert any(turn.views for one in every for turn in one.turns)


def test_a_difference_is_named_with_both_values(
    collection: Collection, verdicts: Callable[..., dict[str, verify.Verdict]]
) -> None:
    def change(one: dict[str, Any]) -> None:
        one["turns"][1]["view"][0].update(distance=99.0)
        one["turns"][2].update(held="Egg")  # not told: it may follow

    name = changed(collection, 3, change)
    told = verdicts(collection)[name].problems
    assert len(told) == 1
    assert told[0].startswith("turn 1: view[0].distance is ")
    assert told[0].endswith(", recorded was 99.0")


def test_the_seed_of_faults_matters(
    collection: Collection, verdicts: Callable[..., dict[str, verify.Verdict]]
) -> None:
    name = changed(collection, 5, lambda one: one.update(seed=one["seed"] + 1))
    problems = verdicts(collection, pictures=False)[name].problems
    assert any("fault is" in problem for problem in problems)


def test_a_changed_picture_is_found_unless_pictures_are_left_out(
    collection: Collection, verdicts: Callable[..., dict[str, verify.Verdict]]
) -> None:
    first = next(collection.trajectories()).turns[0].pictures[0].path
    file = collection.path / first
    pixels = np.asarray(Image.open(file)).copy()
    pixels[:20, :20] = 0
    Image.fromarray(pixels).save(file, "jpeg", quality=85)
    assert f"turn 0: picture {first} differs in" in problem_of(verdicts(collection))[1]
    file.write_bytes(file.read_bytes()[:200])
    assert problem_of(verdicts(collection))[1] == f"turn 0: picture {first} is no whole picture"
    file.unlink()
    assert ": no such file" in problem_of(verdicts(collection))[1]
    assert not any(one.problems for one in verdicts(collection, pictures=False).values())


def test_the_critic_is_asked_about_every_thought(
    collection: Collection,
    verdicts: Callable[..., dict[str, verify.Verdict]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def review(text: str, kind: str, knowledge: Any, *, limit: int) -> critic.Review:
        assert knowledge.instruction
        if kind != "verification":
            return critic.Review((), true=2, unknown=1)
        return critic.Review((Refusal("unseen", f"no {knowledge.turn}"),), false=1)

    monkeypatch.setattr(critic, "review", review)
    found = verdicts(collection, pictures=False)
    every = {one.id: one for one in collection.trajectories()}
    assert all(one.problems for one in found.values())
    for name, verdict in found.items():
        assert verdict.thoughts == sum(len(turn.thoughts) for turn in every[name].turns)
        last = every[name].actions - 1
        assert verdict.problems == (f"turn {last}: verification: unseen: no {last}",)
        assert verdict.sentences == 3 * verdict.thoughts - 2
        assert verdict.unread == verdict.thoughts - 1

    def none(*_: Any, **__: Any) -> critic.Review:
        raise NotImplementedError

    monkeypatch.setattr(critic, "review", none)
    assert all(not one.problems and not one.thoughts for one in verdicts(collection).values())


def test_limit_takes_the_first(
    collection: Collection, verdicts: Callable[..., dict[str, verify.Verdict]]
) -> None:
    first = [one.id for one in collection.trajectories()][:2]
    assert sorted(verdicts(collection, pictures=False, limit=2)) == sorted(first)


# -- the course of actions -----------------------------------------------------------------------


def course(collection: Collection, index: int, **update: Any) -> list[str]:
    return list(course_problems(list(collection.trajectories())[index].model_copy(update=update)))


def test_kind_b_is_the_key_actions_and_nothing_else(played: Collection) -> None:
    every = list(played.trajectories())
    assert course(played, 0, kind="b") == []
    (more,) = course(played, 0, kind="b", turns=[every[0].turns[0], *every[0].turns])
    assert more.startswith("kind b must be the key actions and nothing else, but it is: navigate")
    (failed,) = course(played, 0, kind="c", success=False, end_reason="step limit")
    assert failed == "kind c must succeed, but it ended in 'step limit'"


def test_a_fault_is_recovered(played: Collection) -> None:
    every = list(played.trajectories())[5]
    first = next(index for index, turn in enumerate(every.turns) if turn.fault)
    cut = every.turns[: first + 1]
    (problem,) = course(played, 5, kind="model", success=False, turns=cut)
    assert problem == f"turn {first}: the fault in {every.turns[first].action} is not recovered"
    assert course(played, 5, kind="model", success=False) == []


def test_a_damaged_line_is_named(collection: Collection) -> None:
    with (collection.path / "trajectories.jsonl").open("a") as file:
        file.write('{"id": 3}\n')
    with pytest.raises(CollectionError, match=r"trajectories\.jsonl:8: id: "):
        list(lines_of(collection))
    (collection.path / "trajectories.jsonl").unlink()
    with pytest.raises(CollectionError, match="cannot be read"):
        list(lines_of(collection))


def test_the_suite_is_the_one_that_the_tests_think(played: Collection) -> None:
    assert load_suite(played.manifest.suite).digest == played.manifest.suite_digest
