"""``er-gym tasks`` as a user runs it: generate, verify, show, stats and convert."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from PIL import Image
from support import run_python

from er_gym.tasks import TASK_TYPES, Task, TaskFileError, load_suite, suite_from_file, suites
from er_gym.tasks.describe import describe
from er_gym.tasks.goal import Condition
from er_gym.tasks.jsonl_format import digest, read_tasks, write_tasks
from er_gym.tasks.paraphrase import names_in
from er_gym.tasks.room_kinds import ROOM_KINDS

ROOT = Path(__file__).resolve().parents[2]
COMMAND = [sys.executable, "-m", "benchmarks.cli", "tasks"]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT)}

Command = Callable[..., tuple[int, str, str]]


@pytest.fixture
def er_gym(er_gym: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Command:
    """Runs the command in ``tmp_path``."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ER_GYM_HOME", str(tmp_path / "home"))
    return er_gym


def columns(out: str) -> list[list[str]]:
    """The words of each line."""
    return [line.split() for line in out.splitlines() if line.strip()]


def files_in(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six tasks of two types in two rooms, as the command makes them."""
    file = tmp_path_factory.mktemp("made") / "six.jsonl.gz"
    options = ["--scenes", "FloorPlan5,FloorPlan301", "--types", "single_pickup,pickup_and_put"]
    options += ["--total", "6", "--workers", "1"]
    done = subprocess.run(
        [*COMMAND, "generate", "--out", str(file), *options],
        env=ENVIRONMENT,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    (file.parent / "stdout").write_text(done.stdout)
    (file.parent / "stderr").write_text(done.stderr)
    return file


# -- generate --------------------------------------------------------------------------------------


def test_what_is_made_is_counted(made: Path) -> None:
    out = (made.parent / "stdout").read_text()
    lines = columns(out)
    assert ["Tasks"] in lines
    # Group, type, kitchen, living room, bedroom, bathroom, all.
    (pickups,) = [line for line in lines if line[:2] == ["Manipulate", "single_pickup"]]
    (moves,) = [line for line in lines if line[:2] == ["Transport", "pickup_and_put"]]
    (every,) = [line for line in lines if line[0] == "all"]
    assert (pickups[-1], moves[-1], every[-1]) == ("3", "3", "6")
    for line in (pickups[2:], moves[2:], every[1:]):
        assert int(line[0]) + int(line[2]) == int(line[-1])
        assert line[1] == line[3] == "0"
    assert ["Dropped"] in lines
    assert f"6 tasks of 12 verified: {made}" in out
    assert f"card: {made.with_name('six.md')}" in out
    assert digest(read_tasks(made)) in out
    err = (made.parent / "stderr").read_text()
    assert "2/2 rooms, 12 tasks verified" in err
    assert "were asked for" not in err


def test_a_file_and_a_card_is_all_that_is_left(made: Path) -> None:
    assert sorted(path.name for path in made.parent.iterdir()) == [
        "six.jsonl.gz", "six.md", "stderr", "stdout",
    ]  # fmt: skip
    suite = suite_from_file(made)
    assert len(suite.tasks) == 6
    card = made.with_name("six.md").read_text(encoding="utf-8")
    assert card.startswith("<!-- Written by er-gym -->\n# six\n")
    assert suite.digest in card
    assert '| scenes | ["FloorPlan5", "FloorPlan301"] |' in card


def test_fewer_than_were_asked_for_is_said(er_gym: Command, tmp_path: Path) -> None:
    out = tmp_path / "not" / "there" / "few.jsonl"
    code, shown, err = er_gym(
        *("tasks", "generate", "--out", out, "--scenes", "FloorPlan410", "--types"),
        *("single_toggle", "--per-layout", 1, "--workers", 1),
    )
    assert code == 0
    assert "1 tasks of 1 verified" in shown
    assert err.splitlines()[-1] == "100 were requested; more layouts or rooms give more"
    assert len(read_tasks(out)) == 1
    assert files_in(tmp_path) == ["not/there/few.jsonl", "not/there/few.md"]


def test_limits_are_given_as_ranges(er_gym: Command, tmp_path: Path) -> None:
    out = tmp_path / "limited.jsonl"
    code, _, err = er_gym(
        *("tasks", "generate", "--out", out, "--scenes", "FloorPlan5", "--workers", 1),
        *("--types", "pickup_and_put,ER-PickupFromCloserepAndPutInCloserep-v0"),
        *("--hidden-depth", 2, "--distance", "3.5-8", "--distractors", "0-"),
    )
    assert code == 0, err
    figures = [task.extra["difficulty"] for task in read_tasks(out)]
    assert figures
    assert all(each["hidden_depth"] == 2 for each in figures)
    assert all(3.5 <= each["distance"] <= 8 for each in figures)
    header = json.loads(out.read_text(encoding="utf-8").splitlines()[0])
    assert header["distance"] == [3.5, 8]
    assert header["hidden_depth"] == [2, 2]
    assert "distractors" not in header  # what says nothing is not told


def test_a_suite_that_is_made_is_found_afterwards(
    er_gym: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # As if train did not come with er-gym.
    monkeypatch.setattr(suites, "_DATA", suites._DATA.with_name("nothing"))
    with pytest.raises(TaskFileError, match="run: er-gym tasks generate --suite train") as caught:
        load_suite("train")
    assert str(tmp_path / "home" / "suites") in str(caught.value)
    code, listed, _ = er_gym("suites")
    assert code == 0
    (line,) = [line for line in listed.splitlines() if line.startswith("train: ")]
    assert line.startswith("train: not made yet (er-gym tasks generate --suite train); For train")
    code, _, err = er_gym("tasks", "stats", "train")
    assert (code, err.count("\n")) == (2, 1)
    assert "er-gym tasks generate --suite train" in err

    code, shown, err = er_gym(
        *("tasks", "generate", "--suite", "train", "--scenes", "FloorPlan5", "--types"),
        *("single_pickup", "--total", 4, "--layouts", 0, "--per-layout", 5, "--workers", 1),
    )
    assert code == 0, err
    file = tmp_path / "home" / "suites" / "train.jsonl.gz"
    assert f"4 tasks of 5 verified: {file}" in shown
    assert files_in(tmp_path) == ["home/suites/train.jsonl.gz", "home/suites/train.md"]
    suite = load_suite("train")
    assert len(suite.tasks) == 4
    assert {(task.scene, task.type.name) for task in suite.tasks} == {
        ("FloorPlan5", "single_pickup")
    }
    assert suite.env == suites.suite_config("er-1k").env
    card = file.with_name("train.md").read_text(encoding="utf-8")
    assert "\n# train\n\nGenerated tasks." in card  # not what the suite says
    (command,) = [line for line in card.splitlines() if line.startswith("er-gym tasks generate")]
    for option in ("--suite train", "--total 4", "--scenes FloorPlan5", "--layouts 0", "--seed 0"):
        assert option in command
    assert suite.digest in card
    assert "| unseen_objects | false |" in card  # the suite's own, and not overruled
    assert "train: 4 tasks (Manipulate 4)" in er_gym("suites")[1].splitlines()


MODEL = """
from pathlib import Path

def ask(prompt):
    instruction = prompt.splitlines()[2]
    with open(Path(__file__).with_name("asked.txt"), "a") as asked:
        asked.write(instruction + "\\n")
    return f"Robot, hear me: {instruction}\\nThis is what I ask of you: {instruction}\\nDo it!"
"""


def test_a_language_model_words_some_of_the_tasks(tmp_path: Path) -> None:
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "small_model.py").write_text(MODEL)
    out = tmp_path / "out" / "worded.jsonl"
    options = ["--scenes", "FloorPlan5", "--types", "single_pickup,pickup_and_put", "--total", "8"]
    options += ["--per-layout", "4", "--workers", "1"]

    def generate(*more: str) -> bytes:
        done = subprocess.run(
            [*COMMAND, "generate", "--out", str(out), *options, *more],
            env={**ENVIRONMENT, "PYTHONPATH": os.pathsep.join([str(ROOT), str(folder)])},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return out.read_bytes()

    generate()
    plain = read_tasks(out)
    assert len(plain) == 8
    assert files_in(out.parent) == ["worded.jsonl", "worded.md"]
    first = generate("--paraphraser", "small_model:ask")
    worded = read_tasks(out)
    assert [task.id for task in worded] == [task.id for task in plain]
    pairs = list(zip(worded, plain, strict=True))
    others = [(one, other) for one, other in pairs if one.instruction != other.instruction]
    assert 0 < len(others) < 8
    for one, other in others:
        assert one.instruction in (
            f"Robot, hear me: {other.name}",
            f"This is what I ask of you: {other.name}",
        )
        assert names_in(one.instruction) == names_in(other.name)
    assert [replace(one, instruction=other.instruction) for one, other in pairs] == plain
    assert digest(worded) in out.with_name("worded.md").read_text(encoding="utf-8")

    asked = (folder / "asked.txt").read_text().splitlines()
    assert sorted(asked) == sorted({task.name for task in plain})
    (cache,) = out.parent.glob("worded*paraphrases.jsonl")
    replies = [json.loads(line) for line in cache.read_text().splitlines()]
    assert [reply["instruction"] for reply in replies] == asked
    assert generate("--paraphraser", "small_model:ask") == first
    assert (folder / "asked.txt").read_text().splitlines() == asked


# -- verify ----------------------------------------------------------------------------------------


def test_a_good_suite_is_found_good(er_gym: Command, made: Path) -> None:
    code, out, err = er_gym("tasks", "verify", made, "--workers", 1)
    assert (code, out) == (0, "six: 6 of 6 tasks can be done\n")
    assert "6/6" in err


def test_a_task_that_cannot_be_done_is_named(er_gym: Command, made: Path, tmp_path: Path) -> None:
    good = read_tasks(made)[:2]
    wished = (*good[0].goal, Condition("Fridge", state=(("isOpen", True),)))
    bad = replace(good[0], id="wishful", goal=wished)
    idle = replace(good[0], id="idle", goal=(Condition("Fridge", state=(("isOpen", False),)),))
    write_tasks(tmp_path / "some.jsonl", [good[0], bad, good[1], idle])
    code, out, _ = er_gym("tasks", "verify", "some.jsonl", made, "--workers", 1)
    assert code == 1
    *problems, of_some, of_made = out.splitlines()
    assert sorted(line.split(": ")[:3] for line in problems) == [
        ["some", "idle", "the goal holds from the start"],
        ["some", "wishful", "the goal does not hold in the end"],
    ]
    (said,) = (line for line in problems if "holds from the start" in line)
    assert "Fridge" in said.split(": ", 3)[3]  # what holds
    assert of_some == "some: 2 of 4 tasks can be done"
    assert of_made == "six: 6 of 6 tasks can be done"  # the others are played all the same


# -- show ------------------------------------------------------------------------------------------


def test_show_by_id(er_gym: Command, made: Path) -> None:
    tasks = read_tasks(made)
    code, out, err = er_gym("tasks", "show", made, tasks[4].id, tasks[1].id)
    assert (code, err) == (0, "")
    assert ids_shown(out, tasks) == [tasks[4].id, tasks[1].id]
    for task in (tasks[4], tasks[1]):
        told: Any = task.extra["difficulty"]
        assert describe(task) in out
        assert (
            f"Difficulty: hidden depth {told['hidden_depth']}, distractors {told['distractors']}, "
            f"distance {told['distance']:.1f} m, length {told['length']}"
        ) in out.splitlines()


def ids_shown(out: str, tasks: list[Task]) -> list[str]:
    return [line for line in out.splitlines() if line in {task.id for task in tasks}]


def test_show_without_ids(er_gym: Command, made: Path) -> None:
    tasks = read_tasks(made)
    ids = [task.id for task in tasks]
    assert ids_shown(er_gym("tasks", "show", made)[1], tasks) == ids
    assert ids_shown(er_gym("tasks", "show", made, "--limit", 1)[1], tasks) == [ids[0], ids[3]]
    shown = er_gym("tasks", "show", made, "--limit", 2, "--types", "pickup_and_put")[1]
    assert ids_shown(shown, tasks) == ids[3:5]


def test_show_a_bundled_suite(er_gym: Command) -> None:
    tasks = list(load_suite("mini").tasks)
    code, out, _ = er_gym("tasks", "show", "mini", "--limit", "1")
    assert code == 0
    shown = set(ids_shown(out, tasks))
    assert [task.type for task in tasks if task.id in shown] == list(TASK_TYPES)


def test_a_task_that_tells_no_difficulty_is_shown_without(
    er_gym: Command, made: Path, tmp_path: Path
) -> None:
    task = replace(read_tasks(made)[0], extra={})
    write_tasks(tmp_path / "own.jsonl", [task])
    code, out, err = er_gym("tasks", "show", "own.jsonl")
    assert (code, out.rstrip(), err) == (0, describe(task).rstrip(), "")


# -- stats and convert -----------------------------------------------------------------------------


def test_stats_count(er_gym: Command, made: Path) -> None:
    code, out, err = er_gym("tasks", "stats", made)
    assert (code, err) == (0, "")
    lines = columns(out)
    by_scene = {line[0]: line[1:] for line in lines if line[0].startswith("FloorPlan")}
    assert list(by_scene) == ["FloorPlan5", "FloorPlan301"]
    assert all(len(line) == len(TASK_TYPES) + 1 for line in by_scene.values())
    tasks = read_tasks(made)
    for scene, counts in by_scene.items():
        mine = [task for task in tasks if task.scene == scene]
        expected = [sum(task.type is kind for task in mine) for kind in TASK_TYPES]
        assert [int(count) for count in counts] == [*expected, len(mine)]
    in_training = int(by_scene["FloorPlan5"][-1])
    (seen,) = [line for line in lines if line[0] == "seen"]
    assert 0 < int(seen[-1]) <= in_training < 6
    rest = [int(line[-1]) for line in lines if line[0] == "unseen"]
    assert sum(rest) + int(seen[-1]) == 6


def test_stats_of_a_bundled_suite_add_up(er_gym: Command) -> None:
    code, out, _ = er_gym("tasks", "stats", "er-1k")
    assert code == 0
    lines = columns(out)
    assert ["all", "1000"] in [[line[0], line[-1]] for line in lines]
    scenes = [line for line in lines if line[0].startswith("FloorPlan")]
    assert len(scenes) == 12
    assert sum(int(line[-1]) for line in scenes) == 1000
    assert not any(line[0] == "seen" for line in lines)
    assert all(word in out for kind in ROOM_KINDS for word in kind.split())


def test_stats_draw(er_gym: Command, made: Path, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    folder = tmp_path / "drawn" / "here"
    code, out, _ = er_gym("tasks", "stats", made, "--out", folder)
    assert code == 0
    names = ["types", "objects", "receptacles", "lengths", "rooms"]
    files = [folder / f"{name}.png" for name in names]
    assert out.splitlines()[-5:] == [str(file) for file in files]
    assert files_in(folder) == sorted(file.name for file in files)
    for file in files:
        with Image.open(file) as picture:
            assert picture.format == "PNG"
            assert min(picture.size) > 100


def test_tasks_are_converted_without_loss(er_gym: Command, tmp_path: Path) -> None:
    every = load_suite("er-1k").tasks
    tasks = [next(task for task in every if task.type is kind) for kind in TASK_TYPES]
    tasks += [task for task in every if task.arrangement.poses][:3]
    tasks = list({task.id: task for task in tasks}.values())
    write_tasks(tmp_path / "0.jsonl", tasks)
    row = ["0.jsonl", "1.json", "2.jsonl.gz", "folder", "3.jsonl"]
    for one, other in pairwise(row):
        code, out, err = er_gym("tasks", "convert", one, other)
        assert (code, out) == (0, f"{len(tasks)} tasks: {other}\n"), err
    assert list(suite_from_file("1.json").tasks) == tasks
    assert read_tasks("2.jsonl.gz") == tasks
    by_id = {task.id: task for task in tasks}
    assert {task.id: task for task in read_tasks("3.jsonl")} == by_id


def test_some_tasks_are_converted(er_gym: Command) -> None:
    first, second, third = (task.id for task in load_suite("mini").tasks[:3])
    chosen = ("--task-ids", f"{third},\n{first}", "--task-ids", second)
    assert er_gym("tasks", "convert", "mini", "some.jsonl", *chosen)[:2] == (
        0,
        "3 tasks: some.jsonl\n",
    )
    assert [task.id for task in read_tasks("some.jsonl")] == [first, second, third]
    code, _, err = er_gym("tasks", "convert", "mini", "none.json", "--task-ids", "nowhere")
    assert (code, Path("none.json").exists()) == (2, False)
    assert "no task with the id 'nowhere'" in err


def test_the_paper_tasks_of_the_figures_can_be_taken_from_its_file(
    er_gym: Command, repository: Path, shared_data: Path
) -> None:
    """As docs/tasks.md says; the file of the paper has more tasks than ours."""
    ids = (repository / "docs" / "paper-tasks.txt").read_text(encoding="utf-8")
    theirs = shared_data / "paper_tasks_dev.json"
    code, out, err = er_gym("tasks", "convert", theirs, "tasks.json", "--task-ids", ids)
    assert (code, out) == (0, "272 tasks: tasks.json\n"), err
    assert suite_from_file("tasks.json").tasks == suite_from_file(theirs).tasks


def test_files_of_others_are_replaced_with_force_only(er_gym: Command, tmp_path: Path) -> None:
    """Also those that nobody named, such as the card beside the task file."""
    mine = tmp_path / "notes.md"
    mine.write_text("# er-gym notes\n")
    for name in ("t.json", "t.jsonl", "t.jsonl.gz", "charts/rooms.png"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"mine")
    folder = tmp_path / "folder" / "kitchens" / "FloorPlan1" / "single_pickup_task_metadata.json"
    folder.parent.mkdir(parents=True)
    folder.write_bytes(b"mine")
    task = next(t for t in load_suite("mini").tasks if t.type.name == "single_pickup")
    write_tasks(tmp_path / "one.jsonl", [replace(task, scene="FloorPlan1")])
    before = {name: (tmp_path / name).read_bytes() for name in files_in(tmp_path)}
    generate = ("generate", "--out", "notes.jsonl", "--scenes", "FloorPlan410", "--types")
    commands = [
        (*generate, "single_toggle", "--per-layout", "1", "--workers", "1"),
        ("convert", "one.jsonl", "t.json"),
        ("convert", "one.jsonl", "t.jsonl"),
        ("convert", "one.jsonl", "t.jsonl.gz"),
        ("convert", "one.jsonl", "folder"),
        ("stats", "one.jsonl", "--out", "charts"),
    ]
    for command in commands:
        code, _, err = er_gym("tasks", *command)
        assert (code, err.count("\n")) == (2, 1), command
        assert "er-gym did not write it" in err
        assert {name: (tmp_path / name).read_bytes() for name in files_in(tmp_path)} == before
    for command in commands:
        code, _, err = er_gym("tasks", *command, "--force")
        assert code == 0, err
    after = {name: (tmp_path / name).read_bytes() for name in files_in(tmp_path)}
    assert [name for name in before if after[name] == before[name]] == ["one.jsonl"]
    for command in commands:  # and now they are er-gym's, or the same as before
        code, _, err = er_gym("tasks", *command)
        assert code == 0, err


@pytest.mark.parametrize(
    "out", ["good.jsonl", "good.json", "no/such/good.jsonl", "/dev/full.jsonl"]
)
def test_a_full_disk_harms_no_file(out: str, er_gym: Command, tmp_path: Path) -> None:
    write_tasks(tmp_path / "good.jsonl", load_suite("mini").tasks[:1])
    (tmp_path / "good.json").write_text("[]")
    before = {name: (tmp_path / name).read_bytes() for name in files_in(tmp_path)}
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2000, limits[1]))
    try:
        code, shown, err = er_gym("tasks", "convert", "mini", out, "--force")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert (code, shown, err.count("\n")) == (2, "", 1)
    assert f"{out}: cannot be written: " in err
    assert {name: (tmp_path / name).read_bytes() for name in files_in(tmp_path)} == before


# -- bad input -------------------------------------------------------------------------------------

GENERATE = ("generate", "--workers", "1", "--out", "x.jsonl")
BAD = {
    "neither out nor suite": (("generate", "--total", "4"), ["--out", "--suite"]),
    "suite": (("generate", "--suite", "maxi"), ["'maxi'", "er-1k, er-val, houses-1k, mini, train"]),
    "scene": ((*GENERATE, "--scenes", "FloorPlan5,FloorPlan99"), ["'FloorPlan99'", "training"]),
    "set of scenes": ((*GENERATE, "--scenes", "test"), ["'test'", "FloorPlan1", "evaluation"]),
    "type": ((*GENERATE, "--types", "single_pickup,cook"), ["'cook'", "single_search"]),
    "range": ((*GENERATE, "--distance", "a-b"), ["'a-b'", "A-B", "--distance"]),
    "depth": ((*GENERATE, "--hidden-depth", "1-x"), ["'1-x'", "--hidden-depth"]),
    "range the wrong way": ((*GENERATE, "--distance", "5-2"), ["'distance'", "smaller"]),
    "no number": ((*GENERATE, "--distance", "nan"), ["'distance'", "not a range"]),
    "no scene": ((*GENERATE, "--scenes", ","), ["'scenes'", "unknown scene ''"]),
    "bundled suite": (("generate", "--suite", "mini"), ["'mini'", "--out"]),
    "total": ((*GENERATE, "--total", "0"), ["--total", "0"]),
    "ending": (("generate", "--out", "x.csv"), ["x.csv", ".jsonl or .jsonl.gz"]),
    "paper's ending": (("generate", "--out", "x.json"), ["x.json", ".jsonl or .jsonl.gz"]),
    "folder": (("generate", "--out", "."), ["--out", "directory"]),
    "no spec": ((*GENERATE, "--paraphraser", "nowhere"), ["'nowhere'", "package.module:Name"]),
    "no module": ((*GENERATE, "--paraphraser", "no_such_module:ask"), ["no_such_module"]),
    "no function": (
        (*GENERATE, "--paraphraser", "json:asks"),
        ["'asks'", "a function from a prompt to a reply"],
    ),
    "show what is not there": (("show", "mini", "nope"), ["'nope'", "mini", "ids are such as"]),
    "show a suite that is not there": (("show", "maxi"), ["'maxi'", "mini"]),
    "show a type that is not there": (("show", "mini", "--types", "cook"), ["'cook'"]),
    "verify what is no suite": (("verify", "nowhere.jsonl"), ["nowhere.jsonl: no such file"]),
    "stats of a folder": (("stats", "."), [".json", ".jsonl"]),
    "convert to what is no format": (("convert", "mini", "x.csv"), ["x.csv", "FILE.json"]),
}  # fmt: skip


@pytest.mark.parametrize(("arguments", "words"), BAD.values(), ids=BAD)
def test_bad_input_is_one_line(
    arguments: tuple[str, ...], words: list[str], er_gym: Command, tmp_path: Path
) -> None:
    code, out, err = er_gym("tasks", *arguments)
    assert (code, out) == (2, "")
    assert err.startswith("er-gym: ")
    assert err.count("\n") == 1
    for word in words:
        assert word in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("group", [[], ["generate"], ["verify"], ["show"], ["stats"]])
def test_help_imports_nothing_heavy(group: list[str]) -> None:
    program = (
        f"import sys, runpy; sys.argv = ['er-gym', 'tasks', *{group!r}, '--help']\n"
        "try: runpy.run_module('benchmarks.cli', run_name='__main__')\n"
        "except SystemExit: pass\n"
        "heavy = ('numpy', 'gymnasium', 'pydantic', 'rich', 'ai2thor', 'er_gym', 'matplotlib')\n"
        "print([name for name in heavy if name in sys.modules])"
    )
    done = run_python(program)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
    assert done.stdout.startswith(f"Usage: er-gym {' '.join(['tasks', *group])} ")
