"""Generated suites are the same every time, even after interruptions; and the shipped suites."""

from __future__ import annotations

import gzip
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from benchmarks.cli import main as cli
from benchmarks.cli.suite_builder import BuildResult, build_suite, parts_folder
from er_gym.envs.verify import Verifier
from er_gym.rollout.verification import make_verifier
from er_gym.tasks import TASK_TYPES, Task, jsonl_format, load_suite, suites, verbs
from er_gym.tasks.arrangement import set_up_scene
from er_gym.tasks.difficulty import Difficulty, difficulty
from er_gym.tasks.jsonl_format import read_tasks
from er_gym.tasks.splits import (
    EVALUATION_SCENES,
    TRAINING_SCENES,
    UNSEEN_TYPES,
    split,
    subject_types,
)
from er_gym.tasks.suite_card import card
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.thor import make_controller

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "benchmarks.cli", "tasks", "generate"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}

LONG_RANGE = TASK_TYPES[-1]
PICKUPS = SuiteSpec(
    total=40,
    scenes=("FloorPlan401", "FloorPlan410", "FloorPlan425"),
    types=("single_pickup", "single_toggle", "pickup_and_put"),
)
"""Three bathrooms as recorded: made in a second or two."""
KITCHENS = SuiteSpec(
    total=30,
    scenes=("FloorPlan5", "FloorPlan10", "FloorPlan6", "FloorPlan7"),
    types=("single_pickup", "pickup_from_closerep_and_put"),
)
"""Rooms that are some work each, so that there is time to end the command between two of them."""


def options(spec: SuiteSpec, seed: int) -> list[str]:
    """The options of the command that say the same as a spec."""
    given = ["--seed", str(seed), "--total", str(spec.total), "--layouts", str(spec.layouts)]
    given += ["--per-layout", str(spec.per_layout), "--scenes", ",".join(spec.rooms)]
    return [*given, *(["--types", ",".join(spec.types)] if spec.types else [])]


def generated(out: Path, spec: SuiteSpec, seed: int, workers: int = 1, **environment: str) -> bytes:
    """The file that the command makes, in a process of its own."""
    done = subprocess.run(
        [*COMMAND, "--out", str(out), "--workers", str(workers), *options(spec, seed)],
        env={**ENVIRONMENT, **environment},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return out.read_bytes()


def header(file: Path) -> dict[str, Any]:
    with gzip.open(file, "rt", encoding="utf-8") as lines:
        found: dict[str, Any] = json.loads(lines.readline())
    return found


# -- the same file ---------------------------------------------------------------------------------


def test_a_seed_gives_the_same_bytes_whatever_the_process_and_the_workers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = SuiteSpec(
        total=14,
        scenes=("FloorPlan401", "FloorPlan410"),
        types=("single_pickup", "pickup_and_put"),
        layouts=1,
    )
    here = tmp_path / "here" / "suite.jsonl.gz"
    with pytest.raises(SystemExit) as ended:
        cli.main(
            ["tasks", "generate", "--out", str(here), "--workers", "2", *options(spec, seed=3)]
        )
    assert ended.value.code == 0, capsys.readouterr().err
    there = tmp_path / "there" / "suite.jsonl.gz"
    assert generated(there, spec, 3, PYTHONHASHSEED="1") == here.read_bytes()
    tasks = read_tasks(here)
    assert len(tasks) == spec.total
    assert len({task.arrangement.layout for task in tasks}) == 3  # as recorded, and each room's own
    parts = tmp_path / "parts"
    assert [build_suite(spec, 3, parts=parts).tasks] == [tuple(tasks)]


def test_another_seed_gives_other_tasks_and_other_arrangements(tmp_path: Path) -> None:
    spec = SuiteSpec(total=8, scenes=("FloorPlan401",), types=("single_pickup",), layouts=1)
    one, other = (build_suite(spec, seed, parts=tmp_path / str(seed)).tasks for seed in (0, 1))
    layouts = [{task.arrangement.layout for task in tasks} for tasks in (one, other)]
    assert [len(names) for names in layouts] == [2, 2]
    assert layouts[0] & layouts[1] == {""}
    assert [task.id for task in one] != [task.id for task in other]


def test_each_seed_and_each_making_has_parts_of_its_own(tmp_path: Path) -> None:
    out = tmp_path / "suite.jsonl"
    folders = [
        parts_folder(out, PICKUPS, 0),
        parts_folder(out, PICKUPS, 1),
        parts_folder(out, PICKUPS.model_copy(update={"per_layout": 1}), 0),
        parts_folder(tmp_path / "other.jsonl", PICKUPS, 0),
    ]
    assert len(set(folders)) == 4
    assert parts_folder(out, PICKUPS, 0) == folders[0]
    assert {folder.parent for folder in folders} == {tmp_path}


# -- what is done is not done again ----------------------------------------------------------------


def stamps(parts: Path) -> dict[str, tuple[int, int]]:
    return {
        path.name: (path.stat().st_mtime_ns, path.stat().st_ino) for path in parts.glob("*.jsonl")
    }


def test_an_interrupted_making_goes_on(tmp_path: Path) -> None:
    parts = tmp_path / "parts"
    before: list[str] = []

    def interrupt(scene: str, made: BuildResult) -> None:
        before.append(scene)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        build_suite(PICKUPS, 5, parts=parts, on_room=interrupt)
    assert before == ["FloorPlan401"]
    kept = stamps(parts)
    assert list(kept) == ["FloorPlan401.jsonl"]

    heard: list[tuple[str, BuildResult]] = []
    made = build_suite(PICKUPS, 5, parts=parts, on_room=lambda *room: heard.append(room))
    after = stamps(parts)
    assert len(after) == 3
    assert after["FloorPlan401.jsonl"] == kept["FloorPlan401.jsonl"]
    assert [scene for scene, _ in heard] == list(PICKUPS.rooms)  # of the one that was kept, too
    undisturbed = build_suite(PICKUPS, 5, parts=tmp_path / "undisturbed")
    assert made == undisturbed
    assert made.dropped  # why tasks were dropped is kept with them
    assert made.dropped == sum((room.dropped for _, room in heard), Counter())


def test_what_a_part_says_is_taken_as_it_is(tmp_path: Path) -> None:
    parts = tmp_path / "parts"
    whole = build_suite(PICKUPS, 0, parts=parts)
    file = parts / "FloorPlan410.jsonl"
    mine = read_tasks(file)
    assert len(mine) > 1
    jsonl_format.write_tasks(file, mine[:1], dropped={"on a whim": 7})
    again = build_suite(PICKUPS, 0, parts=parts)
    assert {task.id for task in whole.tasks} - {task.id for task in again.tasks} == {
        task.id for task in mine[1:]
    }
    assert again.dropped["on a whim"] == 7


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The file that the command makes of the kitchens when nothing happens to it."""
    return generated(tmp_path_factory.mktemp("undisturbed") / "suite.jsonl.gz", KITCHENS, 2)


@pytest.mark.parametrize("signum", [signal.SIGKILL, signal.SIGINT], ids=["KILL", "INT"])
def test_an_ended_command_goes_on(
    signum: signal.Signals, undisturbed: bytes, tmp_path: Path
) -> None:
    out = tmp_path / "ended" / "suite.jsonl.gz"
    parts = parts_folder(out, KITCHENS, 2)
    process = subprocess.Popen(
        [*COMMAND, "--out", str(out), "--workers", "1", *options(KITCHENS, 2)],
        env=ENVIRONMENT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        deadline = time.monotonic() + 60
        while not stamps(parts):
            assert process.poll() is None, process.communicate()[1]
            assert time.monotonic() < deadline
            time.sleep(0.01)
    finally:
        os.killpg(process.pid, signum)
    _, complaint = process.communicate(timeout=30)
    kept = {path.name: path.read_bytes() for path in parts.glob("*.jsonl")}
    assert 1 <= len(kept) < 4
    assert not out.exists()
    if signum == signal.SIGINT:
        assert process.returncode == 130
        assert complaint.splitlines()[-1] == (
            f"er-gym: interrupted: {len(kept)} of 4 rooms are in {parts}; "
            "the same command continues"
        )
        assert "Traceback" not in complaint

    assert generated(out, KITCHENS, 2) == undisturbed
    assert [path.name for path in sorted(out.parent.iterdir())] == ["suite.jsonl.gz", "suite.md"]


# -- what is made ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def of_all_types(tmp_path_factory: pytest.TempPathFactory) -> tuple[Task, ...]:
    """Everything that a kitchen and a bathroom give, as recorded and rearranged."""
    spec = SuiteSpec(total=10_000, scenes=("FloorPlan5", "FloorPlan410"), layouts=1, per_layout=2)
    return build_suite(spec, 0, parts=tmp_path_factory.mktemp("all") / "parts", workers=2).tasks


@pytest.fixture(scope="module")
def verifier() -> Iterator[Verifier]:
    with closing(make_verifier()) as verifier:
        yield verifier


def measured(tasks: Sequence[Task], verifier: Verifier) -> Iterator[tuple[Task, Difficulty]]:
    """Each task's difficulty, read off its scene as it begins."""
    with make_controller(headless=True) as controller:
        for task in tasks:
            objects = set_up_scene(controller, task.scene, task.arrangement).metadata["objects"]
            yield task, difficulty(task, objects, verifier(task).start)


def test_every_task_that_is_made_can_be_done(
    of_all_types: tuple[Task, ...], verifier: Verifier
) -> None:
    assert {task.type for task in of_all_types} == set(TASK_TYPES)
    assert {bool(task.arrangement.poses) for task in of_all_types} == {True, False}
    assert len({task.id for task in of_all_types}) == len(of_all_types)
    for task in of_all_types:
        verdict = verifier(task)
        assert verdict.solved, (task.id, verdict)
        assert task.extra["difficulty"]["steps"] == verdict.steps <= task.max_steps


def test_tasks_say_how_difficult_they_are(
    of_all_types: tuple[Task, ...], verifier: Verifier
) -> None:
    for task, figures in measured(of_all_types, verifier):
        told = dict(task.extra["difficulty"])
        del told["steps"]
        assert told == {
            "hidden_depth": figures.hidden_depth,
            "distractors": figures.distractors,
            "distance": round(figures.distance, 2),
            "length": figures.length,
        }, task.id


LIMITS = {"hidden_depth": (1, 1), "distractors": (2, 6), "distance": (4, 9.5)}


@pytest.mark.parametrize("limited", LIMITS)
def test_limits_of_difficulty_are_kept(limited: str, verifier: Verifier, tmp_path: Path) -> None:
    low, high = LIMITS[limited]
    types = ("single_pickup", "single_pickup_from_closerep", "pickup_and_put", "single_toggle")
    spec = SuiteSpec(total=100, scenes=("FloorPlan5",), types=types, **{limited: (low, high)})
    made = build_suite(spec, 0, parts=tmp_path / "parts")
    assert made.tasks
    assert made.dropped["it is not as difficult as asked"]
    for task, figures in measured(made.tasks, verifier):
        assert low <= getattr(figures, limited) <= high, task.id


def test_no_task_is_about_what_training_never_sees(tmp_path: Path) -> None:
    spec = SuiteSpec(
        total=500, scenes=("FloorPlan212",), types=("single_search", "single_pickup"), per_layout=9
    )
    every = build_suite(spec, 0, parts=tmp_path / "every").tasks
    assert any(UNSEEN_TYPES & subject_types(task) for task in every)
    seen = build_suite(
        spec.model_copy(update={"unseen_objects": False}), 0, parts=tmp_path / "seen"
    )
    assert seen.tasks
    assert {split(task) for task in seen.tasks} == {"seen"}
    for task in seen.tasks:
        handled = {action.object_id.split("|")[0] for action in task.key_actions}
        assert UNSEEN_TYPES.isdisjoint(handled), task.id
        assert not any(name in task.instruction for name in UNSEEN_TYPES), task.instruction
    assert seen.dropped["it is about things that training never sees"]


def test_only_the_types_and_rooms_that_are_asked_for(tmp_path: Path) -> None:
    heard: list[BuildResult] = []
    spec = PICKUPS.model_copy(update={"total": 7, "per_layout": 2})
    made = build_suite(
        spec, 0, parts=tmp_path / "parts", on_room=lambda scene, room: heard.append(room)
    )
    assert len(made.tasks) == 7
    assert {task.scene for task in made.tasks} == set(PICKUPS.rooms)
    assert Counter(task.type.name for task in made.tasks) == {
        "single_pickup": 3,
        "single_toggle": 2,
        "pickup_and_put": 2,
    }
    kept = [task for room in heard for task in room.tasks]
    per_layout = Counter((task.scene, task.type) for task in kept)
    assert max(per_layout.values()) == 2
    assert {task.id for task in made.tasks} < {task.id for task in kept}
    assert {task.arrangement.layout for task in kept} == {""}


# -- the suites that we ship -----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["mini", "er-1k"])
def test_a_bundled_card_tells_of_the_bundled_tasks(name: str) -> None:
    suite, config = load_suite(name), suites.suite_config(name)
    file = suites.suite_file(name)
    made = header(file)
    del made["format"], made["tasks"]
    assert (made["suite"], made["seed"]) == (name, 0)
    assert config.generate is not None
    asked = config.generate.model_dump(mode="json", exclude_defaults=True)
    assert {key: made.get(key) for key in asked} == asked

    text = file.with_name(f"{name}.md").read_text(encoding="utf-8")
    assert f"`{suite.digest}`" in text
    command = f"er-gym tasks generate --suite {name} --out {file.name} --seed 0"
    assert text == card(name, config.description, suite.tasks, made, command)


def test_er_1k_is_in_the_evaluation_rooms_alone() -> None:
    tasks = load_suite("er-1k").tasks
    assert len(tasks) == 1000
    scenes = {task.scene for task in tasks}
    assert scenes == set(EVALUATION_SCENES)
    assert scenes.isdisjoint(TRAINING_SCENES)
    assert {split(task) for task in tasks} == {"unseen room", "unseen room and object"}
    assert sum(bool(task.arrangement.poses) for task in tasks) > 500


def test_er_1k_has_as_many_tasks_of_each_type() -> None:
    counts = Counter(task.type for task in load_suite("er-1k").tasks)
    assert set(counts) == set(TASK_TYPES)
    fair = 1000 / len(TASK_TYPES)
    assert all(abs(count - fair) <= fair / 10 for count in counts.values()), counts


@pytest.mark.parametrize("name", ["mini", "er-1k"])
def test_long_range_tasks_are_long(name: str) -> None:
    tasks = [task for task in load_suite(name).tasks if task.type is LONG_RANGE]
    assert len(tasks) >= 12
    assert all(9 <= len(task.key_actions) <= 28 for task in tasks)
    assert all(task.key_actions[-1].verb == verbs.END for task in tasks)
    assert len({len(task.key_actions) for task in tasks}) > 3
