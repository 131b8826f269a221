"""Wherever a type of task is asked for, all of its names are taken."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from agents.expert.recipe import Part
from agents.rl.config import EnvConfig
from agents.rl.guidance import Phase
from benchmarks.cli.suites import chosen_tasks
from benchmarks.study.checks import check_tasks
from benchmarks.study.ladder_settings import LadderSettings
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.selection import select
from er_gym.tasks import TASK_TYPES, load_suite
from er_gym.tasks.suite_spec import SuiteSpec
from tests.support import in_one_test

MINI = load_suite("mini")
LONG = TASK_TYPES[-1].name
COMPOSITE = {row.name for row in TASK_TYPES if row.group == "Composite"}


def _drawn(name: str) -> set[str]:
    env = EmbodiedEnv("mini", task_type=name, obs_mode="state")
    try:
        found = set()
        for seed in range(6):
            env.reset(seed=seed)
            found.add(env.task.type.name)
        return found
    finally:
        env.close()


def _planned(name: str) -> set[str]:
    settings = LadderSettings.model_construct(types=(name,), width=None, height=None, instances="")
    check_tasks(settings, "mini")
    return {task.type.name for task in select(MINI.tasks, types=settings.types)}


SURFACES: dict[str, Callable[[str], set[str]]] = {
    "bench": lambda name: {task.type.name for task in select(MINI.tasks, types=[name])},
    "collect": lambda name: {each.type.name for each in chosen_tasks(MINI, [name], []).tasks},
    "recipe": lambda name: set(Part(actor="expert", types={name: 4}, kinds={"a": 1}).types),
    "training": lambda name: set(EnvConfig(episodes="mini", types=(name,)).types),
    "curriculum": lambda name: set(Phase(until=1, types=(name,)).types),
    "suite": lambda name: set(SuiteSpec(total=1, types=(name,)).types),
    "ladder": _planned,
    "environment": _drawn,
}


@in_one_test("surface", SURFACES)
def test_every_place_takes_every_name(surface: str) -> None:
    taken = SURFACES[surface]
    for name in (LONG, "long_range", "LONG-RANGE", "Long-Range Task with Dependencies"):
        assert taken(name) == {LONG}, name
    assert taken("composite") == COMPOSITE
    with pytest.raises(ValueError, match=r"unknown task type 'compsite' \(did you mean Composite"):
        taken("compsite")


@in_one_test("name", ["long range", "Composite", "Search,long-range", "ER-LongRange-v0"])
def test_commands_take_them(name: str, er_gym: Callable[..., tuple[int, str, str]]) -> None:
    code, out, err = er_gym("tasks", "show", "mini", "--limit", "1", "--types", name)
    assert code == 0, err
    assert "\nLong-Range Task with Dependencies" in out


def test_the_list_of_environments_has_every_name(
    er_gym: Callable[..., tuple[int, str, str]],
) -> None:
    code, out, err = er_gym("envs")
    assert code == 0
    for row in TASK_TYPES:
        (line,) = (line for line in out.splitlines() if line.startswith(f"{row.env_id} "))
        assert row.name in line
        assert row.title in line
    assert "long_range" in out
    assert "or a group: Search, Manipulate, Transport, Composite" in err
