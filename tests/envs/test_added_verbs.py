"""Verbs of another package, one row each, work in every part that uses verbs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from agents.vlm.templates import directory_of, load_templates
from er_gym.envs.actions import ACTIONS

TESTS = Path(__file__).parents[1]
ADDED = ",".join(f"verbs=household_verbs:{name}" for name in ("CLEAN", "FILL", "CROUCH"))


def run(code: list[str], verbs: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join((str(TESTS.parent), str(TESTS / "outside")))
    return subprocess.run(
        [sys.executable, *code],
        env={**os.environ, "PYTHONPATH": path, "ER_GYM_PLUGINS": verbs},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Any:
    out = tmp_path_factory.mktemp("verbs")
    done = run([str(TESTS / "outside/play_with_verbs.py"), str(out)], ADDED)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_actions_are_added_behind_those_there_were(seen: Any) -> None:
    before = [str(action) for action in ACTIONS]
    assert seen["actions"][: len(before)] == before
    added = seen["actions"][len(before) :]
    assert {"crouch", "clean Mug", "fill Mug", "clean Bed"} <= set(added)
    assert "clean Fridge" not in added
    assert len(seen["actions"]) == len(set(seen["actions"]))


def test_replies_are_read(seen: Any) -> None:
    assert seen["parsed"].pop("duck") == ["crouch", ""]
    assert seen["parsed"].pop("把马克杯擦干净") == ["clean", "马克杯"]
    assert set(map(tuple, seen["parsed"].values())) == {("clean", "Mug")}


def test_models_are_told(seen: Any) -> None:
    assert seen["enum"][-1] == "crouch"
    assert {"clean", "fill"} < set(seen["enum"])
    assert seen["meanings en"]["clean <object>"] == "wipe an object with what you hold."
    assert seen["meanings en"]["fill <object>"] == "fill an object."
    assert seen["meanings en"]["crouch"] == "crouch."
    assert seen["meanings zh"]["clean <object>"] == "用手里的海绵或抹布擦干净物体。"
    for language in ("en", "zh"):
        here = load_templates(directory_of("default", language))
        assert {row.form for row in here.actions} < set(seen[f"meanings {language}"])
        assert seen[f"digest {language}"] != here.digest


def test_they_are_played_by_hand(seen: Any) -> None:
    said = {(action, success): feedback for action, success, feedback, _ in seen["played"]}
    assert said["crouch", True] == "Done: crouch."
    assert said["fill Mug", True] == "Done: fill Mug."
    assert said["fill Mug", False] == "You cannot fill Mug. It is not in the state for that."
    assert said["clean Mug", False] == (
        "You cannot clean Mug without a sponge or a cloth in your hand; "
        "pick up a DishSponge or a Cloth first."
    )
    assert "'clean floor' names no action" in said["", False]
    legal = {action: mask for action, success, _, mask in seen["played"] if success}
    assert "fill Mug" in legal["navigate to Mug"]
    assert "fill Mug" not in legal["fill Mug"]
    assert not [name for name in legal["navigate to Mug"] if name.startswith("clean ")]
    assert all("crouch" in mask for mask in legal.values())


def test_a_task_about_them_is_made_and_solved(seen: Any) -> None:
    assert seen["solved"]
    earned = dict(seen["earned"])
    assert [earned[name] for name in earned if name.startswith(("clean ", "fill "))] == [1.0, 1.0]
    assert "clean the " in seen["description"]
    assert "is clean" in seen["description"] or ", clean" in seen["description"]


def test_a_verb_is_registered_before_the_action_space_is_put_together() -> None:
    code = (
        "import er_gym; from er_gym.tasks import verbs; from household_verbs import CROUCH;"
        "verbs.register(CROUCH); verbs.register(CROUCH);"
        "from er_gym.envs.actions import ACTIONS; print(ACTIONS[-1], len(ACTIONS))"
    )
    done = run(["-c", code], "")
    assert done.stdout.split() == ["crouch", str(len(ACTIONS) + 1)], done.stderr


def test_a_module_of_verbs_may_be_the_first_that_is_imported() -> None:
    code = "import household_verbs; from er_gym.envs.actions import ACTIONS; print(ACTIONS[-1])"
    assert run(["-c", code], ADDED).stdout.startswith("fill ")


def test_the_command_says_what_is_wrong_with_a_verb() -> None:
    command = ["-m", "benchmarks.cli", "bench", "--suite", "mini", "--agent", "random"]
    done = run(command, "verbs=household_verbs:NOTHING")
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "'household_verbs' has no 'NOTHING'" in done.stderr
