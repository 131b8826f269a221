"""``er-gym collect`` with the scripted expert: real rooms, real processes, small pictures."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from small_suite import NAME, small
from support import ROOT

from agents.expert.acceptance import PlayedCourse, rejection
from agents.zoo.index import weights_of
from benchmarks.cli.main import cli as command
from er_gym.data.collection import Collection
from er_gym.data.trajectory import Trajectory
from er_gym.tasks import jsonl_format

ErGym = Callable[..., tuple[int, str, str]]
PLAIN = ("--suite", NAME, "--parts", "imitation", "--types", "single_search,single_pickup")
FEW, SOME = 2, 4


def collect(out: Path, *more: object) -> str:
    """Run the command in this process; returns what it printed."""
    told = CliRunner().invoke(
        command, ["collect", "--out", str(out), *map(str, more)], standalone_mode=False
    )
    assert told.exception is None, told.output
    assert told.return_value == 0, told.output
    return told.output


def content(out: Path) -> dict[str, bytes]:
    """What was collected: files by their path, without the runs' own records, which have times."""
    files = [*out.glob("*.json*"), *out.glob("parts/*/pictures/*/*")]
    return {
        str(path.relative_to(out)): path.read_bytes()
        for path in [*files, *out.glob("parts/*/trajectories/*")]
    }


def trajectories(out: Path) -> list[Trajectory]:
    return list(Collection.open(out).trajectories())


def assert_whole(out: Path) -> None:
    """Whatever can be read is whole, its pictures too."""
    collection = Collection.open(out)
    for each in trajectories(out) if (out / "trajectories.jsonl").exists() else ():
        assert collection.played(each.part, each.id) == each
        assert collection.has_pictures(each)


@pytest.fixture(scope="module")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A collection by one worker that nothing has disturbed; tests leave it as it is."""
    out = tmp_path_factory.mktemp("collected") / "x"
    told = collect(out, *PLAIN, "--limit", SOME, "--workers", 1)
    assert f"{SOME} trajectories in " in told
    # A prescreening foretells how an episode comes out: none is played that is not taken.
    assert f"; {SOME} episodes played now" in told
    return out


def test_what_is_collected(collected: Path) -> None:
    every = trajectories(collected)
    assert len(every) == SOME
    assert {each.part for each in every} == {"imitation"}
    assert {each.task_type for each in every} == {"single_search", "single_pickup"}
    for each in every:
        assert rejection(PlayedCourse.of_trajectory(each), 11) == ""
        for turn in each.turns:
            assert turn.thoughts
            assert all((one.width, one.height) == (64, 36) for one in turn.pictures)
    assert_whole(collected)


def test_without_pictures_the_rest_is_the_same(
    collected: Path, tmp_path: Path, er_gym: ErGym
) -> None:
    out = tmp_path / "x"
    collect(out, *PLAIN, "--limit", FEW, "--workers", 1, "--no-pictures")
    there = {each.id: each for each in trajectories(collected)}
    for each in trajectories(out):
        assert not each.pictures
        before = there[each.id]
        assert [turn.view for turn in each.turns] == [turn.view for turn in before.turns]
        assert [turn.action for turn in each.turns] == [turn.action for turn in before.turns]
    assert not list(out.rglob("*.jpeg"))
    code, shown, told = er_gym("data", "verify", out, "--suite", NAME)
    assert code == 0, told
    assert " 0 pictures" in shown


def test_a_collection_grows_and_two_workers_give_what_one_gives(
    collected: Path, tmp_path: Path
) -> None:
    out = tmp_path / "x"
    collect(out, *PLAIN, "--limit", FEW, "--workers", 1)
    few = trajectories(out)
    assert len(few) == FEW
    times = {path: path.stat().st_mtime_ns for path in out.glob("parts/*/*/**/*.j*")}
    assert len(times) > 3 * FEW
    told = collect(out, *PLAIN, "--limit", SOME, "--workers", 2)
    assert f"{SOME - FEW} episodes played now" in told
    assert content(out) == content(collected)
    assert all(each in trajectories(out) for each in few)
    assert all(path.stat().st_mtime_ns == at for path, at in times.items())


def test_a_killed_command_continues(collected: Path, tmp_path: Path) -> None:
    out = tmp_path / "x"
    given = ["collect", "--out", out, *PLAIN, "--limit", SOME, "--workers", 1]
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.cli", *map(str, given)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{ROOT / 'tests'}"},
        stderr=subprocess.PIPE,
    ) as process:
        until(lambda: bool([*out.glob("parts/*/episodes/*.json")]), process)
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not (out / "trajectories.jsonl").exists()
    first = next(out.glob("parts/*/episodes/*.json"))
    Collection.open(out).played("imitation", first.stem)
    told = collect(out, *PLAIN, "--limit", SOME, "--workers", 1)
    assert f"{SOME} episodes played now" not in told
    assert content(out) == content(collected)


def until(ready: Callable[[], bool], process: subprocess.Popen[bytes]) -> None:
    end = time.monotonic() + 100
    while not ready():
        assert process.poll() is None, process.stderr and process.stderr.read()
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_full_disk(
    collected: Path, tmp_path: Path, er_gym: ErGym, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two thirds of the files fit; then every write fails, as it does when the disk is full."""
    out = tmp_path / "x"
    room = len(content(collected)) * 2 // 3
    written = 0

    def fsync(handle: int) -> None:
        nonlocal written
        written += 1
        if written > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    given = ("collect", "--out", out, *PLAIN, "--limit", SOME, "--workers", 1)
    with monkeypatch.context() as full:
        full.setattr(os, "fsync", fsync)
        code, _, told = er_gym(*given)
    assert code == 2
    assert "No space left on device" in told
    assert f"the same command continues {out}" in told
    assert not [*out.rglob("*.tmp"), *out.rglob("*.draft")]
    assert_whole(out)
    assert len([line for line in told.splitlines() if line.startswith("er-gym: ")]) == 1
    code, _, told = er_gym(*given)
    assert (code, content(out)) == (0, content(collected)), told


def test_what_was_damaged_is_played_again(collected: Path, tmp_path: Path) -> None:
    out = shutil.copytree(collected, tmp_path / "x")
    one, two, three, _ = sorted(out.glob("parts/*/trajectories/*"))
    one.write_bytes(one.read_bytes()[:-100])
    two.unlink()
    next(out.glob(f"parts/*/pictures/{three.stem}/*")).unlink()
    (out / "trajectories.jsonl").write_text("{")
    (out / "parts/imitation/episodes" / three.name).write_text("{")
    told = collect(out, *PLAIN, "--limit", SOME, "--workers", 1)
    assert "; 3 episodes played now" in told
    assert content(out) == content(collected)


def test_failed_episodes_of_a_run_are_corrected(tmp_path: Path, er_gym: ErGym) -> None:
    run, out = tmp_path / "run", tmp_path / "x"
    given = ("bench", "--suite", NAME, "--agent", "random", "--limit", 8, "--workers", 1)
    code, _, told = er_gym(*given, "--out", run)
    assert code == 0, told
    failed = {
        one["task_id"]: one
        for one in map(json.loads, (path.read_text() for path in run.glob("episodes/*.json")))
        if not one["success"]
    }
    told = collect(out, "--correct", run, "--limit", 3, "--workers", 1)
    every = trajectories(out)
    assert every, told
    for each in every:
        assert (each.kind, each.success) == ("corrected", True)
        assert each.correction is not None
        assert (each.correction.run, each.correction.episode) == ("run", each.task_id)
        wrong = each.correction.first_wrong
        begun = [(step["verb"], step["object_type"]) for step in failed[each.task_id]["steps"][1:]]
        replayed = [(turn.verb, turn.object_type) for turn in each.turns]
        assert replayed[: wrong + 1] == begun[: wrong + 1]
        assert not any(turn.train for turn in each.turns[: wrong + 1])
        assert all(turn.train for turn in each.turns[wrong + 1 :])
        assert each.turns[wrong + 1].thoughts[0].kind == "reflection"
    for option, message in (
        ("--recipe", "--recipe is for a recipe; --correct RUN collects without one"),
        ("--kinds", "--kinds is for a recipe"),
        ("--suite", f"{run} was played with other tasks than those of "),
        ("--correct-by", "'mini' cannot take over an episode; give expert, searcher, spotter"),
    ):
        code, _, told = er_gym("collect", "--correct", run, "--out", out, option, "mini")
        assert code == 2
        assert message in told
    code, _, told = er_gym("collect", "--correct", run, "--out", out, "--correct-after", "failure")
    assert code == 2
    assert "correct_after" in told  # the collection has others
    late = tmp_path / "late"
    after: tuple[str | int, ...] = ("--correct-after", "refusal", "--correct-steps", 60)
    told = collect(late, "--correct", run, *after, "--limit", 3, "--workers", 1)
    corrected = trajectories(late)
    assert corrected, told
    for each in corrected:
        assert each.max_steps == 60
        assert each.correction is not None
        assert not each.turns[each.correction.first_wrong].success
        assert each.id.endswith(f"-corrected-{each.correction.first_wrong + 1}")  # one of several
    code, shown, told = er_gym("data", "verify", late, "--suite", NAME)
    assert code == 0, (shown, told)
    policy = tmp_path / "policy"
    after = (*after, "--correct-by", "zoo:all-sightings")
    told = collect(policy, "--correct", run, *after, "--limit", 2, "--workers", 1)
    assert trajectories(policy), told
    settings = Collection.open(policy).manifest.settings
    assert settings["correct_by"] == "zoo:all-sightings"
    assert settings["corrector_weights"] == weights_of("zoo:all-sightings")["weights"]
    code, shown, told = er_gym("data", "verify", policy, "--suite", NAME)
    assert code == 0, (shown, told)
    told = collect(policy, "--correct", run, *after, "--limit", 2, "--workers", 1)
    assert "; 0 episodes played now" in told
    other = (*after[:-1], "spotter")
    code, _, told = er_gym("collect", "--correct", run, *other, "--limit", 2, "--out", policy)
    assert code == 2
    assert "correct_by" in told
    files = [policy / "collection.json", *policy.glob("parts/*/run.json")]
    told_by = '"correct_by":"zoo:all-sightings"'
    texts = {file: file.read_text().replace('"correct_by": ', '"correct_by":') for file in files}
    assert all(told_by in text for text in texts.values())
    for odd in ("nope", "zoo:nope", "zoo:er-tiny-vl", "", 5, ["x"]):
        for file, text in texts.items():
            file.write_text(text.replace(told_by, f'"correct_by":{json.dumps(odd)}'))
        code, shown, told = er_gym("data", "verify", policy, "--suite", NAME)
        assert code == 2, (odd, shown, told)
        assert "say who corrected it, but" in told, (odd, shown, told)
    faulty = tmp_path / "faulty"
    code, _, told = er_gym(*given, "--faults", 0.1, "--out", faulty)
    assert code == 0, told
    code, _, told = er_gym("collect", "--correct", faulty, "--out", tmp_path / "y", *after)
    assert code == 2
    assert "was played with faults" in told
    for option, value in (
        ("--correct-after", "failure"),
        ("--correct-by", "searcher"),
        ("--correct-steps", 60),
    ):
        code, _, told = er_gym("collect", "--suite", NAME, "--out", out, option, value)
        assert code == 2
        assert f"{option} is for --correct RUN" in told


def test_a_collection_of_nothing_is_no_success(tmp_path: Path, er_gym: ErGym) -> None:
    recipe = tmp_path / "never.yaml"
    recipe.write_text(
        "parts: {x: {actor: expert, kinds: {a: 1}, types: {single_search: 2}, most_actions: 1}}"
    )
    given = ("--suite", NAME, "--recipe", recipe, "--workers", 1, "--out", tmp_path / "x")
    code, _, told = er_gym("collect", *given)
    assert code == 1
    assert "0 trajectories in " in told
    assert "x: 2 trajectories of single_search are missing; the tasks yield no more" in told


@dataclass(frozen=True)
class Bad:
    """Options that are refused, and what the line says."""

    options: Mapping[str, object]
    message: str


BAD = {
    "no tasks": Bad(
        {"suite": None}, "give --suite (one of: er-1k, er-val, houses-1k, mini, train)"
    ),
    "suite": Bad(
        {"suite": "nope"},
        "unknown suite 'nope'; choose one of: er-1k, er-val, houses-1k, mini, train",
    ),
    "limit": Bad({"limit": 0}, "'--limit': 0 is not in the range x>=1"),
    "no number": Bad({"limit": "all"}, "'--limit': 'all' is not a valid"),
    "workers": Bad({"workers": 0}, "'--workers': 0 is not in the range"),
    "recipe": Bad({"recipe": "mine"}, "there is no recipe 'mine'; give a YAML file, or one of: b"),
    "part": Bad({"parts": "all"}, "unknown part 'all'; the recipe has: imitation, exploration, "),
    "parts": Bad({"parts": ","}, "--parts ',' names nothing"),
    "kind": Bad({"kinds": "d"}, "unknown kind 'd'; the recipe has: a, b, c"),
    "kinds": Bad({"kinds": ""}, "--kinds '' names nothing"),
    "kind of an explorer": Bad(
        {"kinds": "a", "parts": "exploration"}, "--kinds is for parts that an expert plays"
    ),
    "type": Bad({"types": "dance"}, "unknown task type 'dance'; choose one of: single_search"),
    "no such tasks": Bad(
        {"types": "long-range tasks with dependency relationships"},
        "none of the tasks is of a type that the recipe asks for: single_search",
    ),
    "scene": Bad({"scenes": "FloorPlan999"}, "mini has no task in FloorPlan999"),
    "no task there": Bad(
        {"scenes": "FloorPlan1", "types": "ordered_pickup_two_object_and_put"},
        "has no task of the types ordered_pickup_two_object_and_put in FloorPlan1",
    ),
    "language": Bad({"language": "fr"}, "'--language': 'fr' is not one of 'en', 'zh'"),
    "writer": Bad({"writer": "me"}, "unknown writer of thoughts 'me'; choose one of: grounded"),
    "no writer": Bad({"writer": "json:loads"}, "'json:loads' cannot be made (TypeError: "),
    "not a writer": Bad({"writer": "builtins:dict"}, "is {}, which lacks a name or write"),
    "thoughts": Bad({"thoughts": "none"}, "there is no table of transitions 'none'; give a YAML"),
    "empty name": Bad({"out": ""}, "'--out': an empty name"),
    "a file": Bad({"out": __file__}, "is a file"),
    "not empty": Bad({"out": ROOT / "docs"}, "is not empty and holds no collection.json; choose"),
    "no run": Bad({"correct": ROOT / "docs"}, "docs is no run: "),
}


@pytest.mark.parametrize("bad", BAD.values(), ids=BAD)
def test_bad_input_is_told_in_one_line(bad: Bad, tmp_path: Path, er_gym: ErGym) -> None:
    options: dict[str, Any] = {"suite": "mini", "limit": 1, "out": tmp_path / "x", **bad.options}
    given = [
        word for name, it in options.items() if it is not None for word in (f"--{name}", str(it))
    ]
    code, out, err = er_gym("collect", *given)
    (line,) = err.splitlines()
    assert (code, out) == (2, "")
    assert line.startswith("er-gym: ")
    assert bad.message in line
    assert not (tmp_path / "x").exists()


OTHERS = {
    "suite": ("--suite", "mini"),
    "seed": ("--seed", 5),
    "settings.language": ("--language", "zh"),
    "settings.tasks": ("--types", "single_search"),
    "settings.recipe.parts.imitation.kinds.a": ("--kinds", "b"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_another_collection_is_not_mixed_in(name: str, collected: Path, er_gym: ErGym) -> None:
    before = content(collected)
    code, _, err = er_gym("collect", "--out", collected, *PLAIN, "--limit", 1, *OTHERS[name])
    (line,) = err.splitlines()
    assert code == 2
    assert f"{collected} holds another collection: its {name} is " in line
    assert "choose another --out, or repeat that command" in line
    assert content(collected) == before


def test_a_part_of_a_collection_is_no_place_for_another(collected: Path, er_gym: ErGym) -> None:
    part = collected / "parts" / "imitation"
    code, _, err = er_gym("collect", "--out", part, *PLAIN, "--limit", 1)
    assert code == 2
    assert "is a run (it holds run.json); choose another --out" in err
    assert not (part / "collection.json").exists()


def test_tasks_that_cannot_be_played_are_named(tmp_path: Path, er_gym: ErGym) -> None:
    one, two, *_ = small().tasks
    file = tmp_path / "mine.jsonl"
    for tasks, message in (
        ([replace(one, scene="FloorPlan999")], "mine.jsonl: no task can be used: "),
        ([replace(one, scene="FloorPlan999"), two], "mine: set aside: "),
    ):
        jsonl_format.write_tasks(file, tasks)
        code, _, err = er_gym("collect", "--tasks-file", file, "--out", ROOT / "docs")
        assert code == 2
        (line,) = [line for line in err.splitlines() if message in line]
        assert "FloorPlan999" in line
