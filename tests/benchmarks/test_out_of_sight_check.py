"""Which failures had looked where the thing lay, and what would have shown it."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from benchmarks.checks.out_of_sight import (
    NOT_THERE,
    Lost,
    _outcome,
    actions_to_see,
    looked_at,
    lost_thing,
    main,
)
from benchmarks.cli.main import cli as er_gym
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import load_suite, verbs
from er_gym.tasks.task import Task, type_of_id


@pytest.fixture(scope="module")
def hidden() -> Task:
    """Something is to be fetched out of something closed and put elsewhere."""
    tasks = load_suite("mini").tasks
    return next(each for each in tasks if each.type.name == "pickup_from_closerep_and_put")


def record(*steps: tuple[str, str, bool, tuple[str, ...]]) -> Any:
    names = ("verb", "object_id", "success", "interactable")
    return SimpleNamespace(
        steps=[SimpleNamespace(**dict(zip(names, s, strict=True))) for s in steps]
    )


def test_what_was_not_found_and_whether_its_place_was_looked_at(hidden: Task) -> None:
    place = next(each.object_id for each in hidden.key_actions if each.verb == verbs.OPEN)
    thing = next(each.actual_type for each in hidden.key_actions if each.verb == verbs.PICKUP)
    went = (verbs.NAVIGATE, place, True, ())
    lost = lost_thing(hidden, record(went))
    assert lost == Lost(thing, place, verbs.OPEN)
    assert looked_at(lost, record(went)) is None  # it is closed
    assert looked_at(lost, record(went, (verbs.OPEN, place, False, ()))) is None
    assert looked_at(lost, record(went, went, (verbs.OPEN, place, True, ()))) == 2
    assert lost_thing(hidden, record(went, (verbs.OBSERVE, "", True, (thing,)))) is None
    search = next(each for each in load_suite("mini").tasks if each.type.search)
    [sought] = {each.object_type for each in search.goal}
    assert lost_thing(search, record((verbs.INIT, "", True, ()))).thing == sought  # type: ignore[union-attr]


def test_the_fewest_actions_that_show_a_thing(hidden: Task) -> None:
    """To go to the closed place and open it takes two, or one from before it."""
    lost = lost_thing(hidden, record())
    assert lost is not None
    with EmbodiedEnv(obs_mode="state", instances="target") as env:
        env.reset(options={"task": hidden})
        assert actions_to_see(env, lost.thing, 1) == ()
        env.reset(options={"task": hidden})
        path = actions_to_see(env, lost.thing, 2)
        assert [each.verb for each in path] == [verbs.NAVIGATE, verbs.OPEN]
        env.reset(options={"task": hidden})
        env.step(f"navigate to {type_of_id(lost.place)}")
        assert [each.verb for each in actions_to_see(env, lost.thing, 2)] == [verbs.OPEN]


def test_what_would_have_shown_it(hidden: Task) -> None:
    """An agent opens the place, and misses the thing before it."""
    lost = lost_thing(hidden, record())
    assert lost is not None
    steps = [
        (verbs.INIT, "", ""),
        *((v, lost.place, type_of_id(lost.place)) for v in (verbs.NAVIGATE, verbs.OPEN)),
    ]
    made = [
        SimpleNamespace(verb=verb, object_id=where, object_type=kind, success=True, interactable=())
        for verb, where, kind in steps
    ]
    with EmbodiedEnv(obs_mode="state", instances="target") as env:
        for number, outcome in ((3, "1"), (2, NOT_THERE)):
            episode: Any = SimpleNamespace(steps=made[:number], seed=0, task_id=hidden.id)
            assert _outcome(env, hidden, episode, 1) == [outcome]
        found = SimpleNamespace(steps=[SimpleNamespace(interactable=(lost.thing,))])
        assert _outcome(env, hidden, found, 1) == []  # type: ignore[arg-type]


def test_the_table_of_runs(tmp_path: Path) -> None:
    run = str(tmp_path / "run")
    command = ["bench", "--suite", "er-val", "--limit", "12", "--spread", "--agent", "random"]
    command += ["--instances", "explore", "--out", run]
    assert CliRunner().invoke(er_gym, command).exit_code == 0
    shown = CliRunner().invoke(main, [run, "--steps", "1"])
    assert shown.exit_code == 0, shown.output
    [row] = [line for line in shown.output.splitlines() if line.startswith("| run")]
    failures, lost, elsewhere, one, closing, more = map(int, row.split("|")[2:-1])
    assert 12 >= failures >= lost == elsewhere + one + more > 0
    assert closing <= one
    missing = CliRunner().invoke(main, [str(tmp_path / "none")])
    assert missing.exit_code == 1
    assert "is no run" in missing.output
