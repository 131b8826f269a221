"""A task type, a shape and an AI2-THOR action of another package: one file and one row each."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import gymnasium
import pytest

from er_gym.plugins import PluginError
from er_gym.sim.actions import ACTIONS
from er_gym.sim.render.shapes import SHAPES
from er_gym.sim.render.shapes.registry import shape
from er_gym.tasks.types import BY_NAME, TASK_TYPES, register, task_type

TESTS = Path(__file__).parent
ADDED = {
    "ER_GYM_PLUGINS": "task_types=household_tasks:OPEN,"
    "actions=household_engine:polish,shapes=household_engine:lava_lamp",
}
ENTRY_POINTS = """\
[er_gym.task_types]
open = household_tasks:OPEN
[er_gym.actions]
polish = household_engine:polish
[er_gym.shapes]
lava-lamp = household_engine:lava_lamp
"""


def run(code: list[str], *folders: Path, **variables: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(map(str, (TESTS.parent, TESTS / "outside", *folders)))
    return subprocess.run(
        [sys.executable, *code],
        env={**os.environ, "PYTHONPATH": path, **variables},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.fixture(scope="module", params=["variables", "entry points"])
def seen(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    out = tmp_path_factory.mktemp("rows")
    variables = ADDED if request.param == "variables" else {}
    if not variables:
        info = out / "household-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: household\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(ENTRY_POINTS)
    done = run([str(TESTS / "outside/play_with_rows.py"), str(out)], out, **variables)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_rows_come_behind_those_there_were(seen: Any) -> None:
    assert seen["types"] == [*(kind.name for kind in TASK_TYPES), "single_open"]
    assert seen["generated"] == seen["types"]
    assert seen["again"]
    assert sorted({*ACTIONS, "PolishObject"}) == sorted(seen["actions"])
    assert sorted({*SHAPES, "LavaLamp"}) == sorted(seen["shapes"])


def test_a_task_of_an_added_type_is_made_and_solved(seen: Any) -> None:
    assert "pen" in seen["instruction"]
    assert seen["solved"]


def test_an_added_action_is_done_with_its_parameters(seen: Any) -> None:
    assert seen["polished"] == [2.0, False]
    assert seen["refused"] == "shine is -1; give more than 0."
    assert "Expected arguments: String objectId, float shine = 1.0" in seen["invalid"]


def test_an_added_shape_is_drawn(seen: Any) -> None:
    """And not the plain box that stands for a type without a shape."""
    assert min(seen["differ"]) > 20


def test_the_command_lists_added_types_and_says_what_is_wrong_with_one() -> None:
    listed = run(["-m", "benchmarks.cli", "envs"], **ADDED)
    assert listed.stdout.splitlines()[-1].split() == [
        *("Household-Open-v0", "Manipulate:", "Opening,", "24", "steps;"),
        *("single_open,", "household_open"),
    ]
    wrong = run(["-m", "benchmarks.cli", "envs"], ER_GYM_PLUGINS="task_types=household_tasks:CLOSE")
    assert wrong.returncode == 2
    assert wrong.stderr.count("\n") == 1
    assert "'household_tasks' has no 'CLOSE'" in wrong.stderr


GOOD = replace(TASK_TYPES[0], name="single_open", env_id="Household-Open-v0")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"name": ""}, "name is ''; give a line of text"),
        ({"name": "single_search"}, "'single_search' is the name of another type"),
        ({"name": "ER-SingleSearch-v0"}, "is the name of another type"),
        ({"env_id": "ER-LongRange-v0"}, "'ER-LongRange-v0' is the name of another type"),
        ({"env_id": "Household Open"}, "give one such as 'My-Task-v0'"),
        ({"title": "two\nlines"}, "title is 'two"),
        ({"group": "Chores"}, "group is 'Chores'; choose one of: Search, Manipulate"),
        ({"max_steps": 1}, "max_steps is 1; give a whole number from 2"),
        ({"max_steps": "24"}, "max_steps is '24'"),
        ({"rules": ("row",)}, "a rule that generates tasks is 'row'; give a TaskRule of"),
    ],
)
def test_a_type_that_cannot_be_used(change: dict[str, Any], message: str) -> None:
    before = dict(BY_NAME)
    with pytest.raises(PluginError, match=message):
        register(replace(GOOD, **change))
    assert before == BY_NAME


def test_a_type_that_is_registered_by_hand_has_its_id() -> None:
    row = replace(GOOD, name="by hand", env_id="Household-ByHand-v0")
    try:
        assert register(row) is row is register(row)
        assert task_type("Household-ByHand-v0") is row
        assert gymnasium.spec("Household-ByHand-v0").kwargs == {"task_type": "by hand"}
    finally:
        from er_gym.tasks.types import BY_ENV_ID

        del BY_NAME[row.name], BY_ENV_ID[row.env_id], gymnasium.registry[row.env_id]


def test_a_type_has_one_shape() -> None:
    with pytest.raises(ValueError, match="object type 'Mug' has a shape already"):
        shape("Mug")(SHAPES["Bowl"])
