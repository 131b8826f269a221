"""The fuzz plays the same for a seed, tries every action, and finds faults."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace
from random import Random

import numpy as np
import pytest
from click.testing import CliRunner

from benchmarks.checks import fuzz as fuzz_script
from benchmarks.checks.fuzz import fuzz, main, play, play_run
from benchmarks.checks.fuzz_checks import (
    QUESTIONS,
    CompanyChecker,
    can_be_serialised,
    floor,
    pictures_fit,
)
from benchmarks.checks.fuzz_report import FuzzPlan, FuzzReport, show
from benchmarks.checks.fuzz_requests import MUTATIONS, PARAMETERS, SANE, Room, draw_request
from er_gym.sim import engine as engine_module
from er_gym.sim.actions import ACTIONS
from er_gym.sim.engine import Engine
from er_gym.sim.errors import ActionFailed

SCENES = ("FloorPlan1", "FloorPlan210", "FloorPlan403")
KITCHENS = ("FloorPlan1", "FloorPlan2", "FloorPlan3", "FloorPlan4")


def played(plan, runs=None):
    """One report of all runs of a plan, in this process."""
    total = FuzzReport()
    for run in range(plan.runs) if runs is None else runs:
        total.add(play_run(run, plan=plan))
    return total


@pytest.fixture(scope="module")
def long_play():
    return played(FuzzPlan(seed=5, actions=1600, scenes=KITCHENS))


def test_a_short_play_has_no_problem():
    total = played(FuzzPlan(seed=3, actions=300, scenes=SCENES))
    assert [str(step) for step in total.wrong] == []
    assert total.total.tries == 300
    assert total.total.successes > 100


def test_through_the_client_too(monkeypatch):
    monkeypatch.setattr(fuzz_script, "EngineDriver", None)
    total = played(FuzzPlan(seed=2, actions=2000, scenes=SCENES), [9])
    assert total.total.tries == 200


def test_the_same_seed_asks_the_same():
    def requests(seed, run):
        plan = FuzzPlan(seed, actions=400, scenes=SCENES)
        return [repr(step.request) for step, _ in zip(play(plan, run), range(60), strict=False)]

    assert requests(0, 1) == requests(0, 1)
    assert requests(0, 1) != requests(0, 0)
    assert requests(0, 1) != requests(1, 1)


def test_workers_make_no_difference():
    plan = FuzzPlan(seed=0, actions=250, scenes=SCENES)
    shared, alone = FuzzReport(), played(plan)
    for report in fuzz(plan, workers=2):
        shared.add(report)
    assert shared.total.tries == alone.total.tries == 250
    assert shared.fingerprint == alone.fingerprint


def test_every_action_is_tried_and_most_of_them_are_done(long_play):
    unchecked = {"SetObjectFilter", "SetObjectFilterForType"}  # they hide what the checks need
    assert {*ACTIONS, "Reset"} - unchecked <= long_play.tallies.keys()
    never = {name for name, tally in long_play.tallies.items() if not tally.successes}
    # These need a state that is seldom there, and come ten times in such a play.
    assert len(never & ACTIONS.keys()) <= 14
    assert 0.3 < long_play.total.successes / long_play.total.tries < 0.8


# -- requests --------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def room():
    metadata, _ = Engine(8, 8).step({"action": "Reset", "sceneName": "FloorPlan1"})
    return Room(Random(0), SCENES, dict(metadata), floor("FloorPlan1", 0.25), ["Egg|1|1|1"])


def test_the_table_knows_no_parameter_that_nothing_takes():
    taken = {
        name
        for action, taken in PARAMETERS.items()
        for parameter in taken
        for name in (parameter, f"{action}.{parameter}")
    }
    assert SANE.keys() <= taken


@pytest.mark.parametrize(
    "mutation", MUTATIONS[::2] + MUTATIONS[1::2], ids=lambda mutation: mutation.__name__
)
def test_a_mutated_request_is_still_a_request(room, mutation):
    for _ in range(200):
        request = draw_request(room)
        before = repr(room.metadata["objects"][:3])
        mutation(room, request)
        assert all(isinstance(name, str) for name in request)
        assert repr(room.metadata["objects"][:3]) == before


def test_an_empty_request_can_be_bent(room):
    for mutation in MUTATIONS:
        for _ in range(10):
            mutation(room, {})


# -- what it finds ---------------------------------------------------------------------------------


def run_instead(monkeypatch, action, run):
    """Have an action done by something else, whichever way it is called."""
    ways = tuple(replace(way, run=run) for way in ACTIONS[action])
    monkeypatch.setitem(ACTIONS, action, ways)


def raises(world):
    raise ZeroDivisionError("no clean refusal")


def warns(world):
    warnings.warn("said on stderr", stacklevel=1)


def returns_nan(world):
    return {"poses": [1.0, float("nan")]}


def returns_an_array(world):
    return np.zeros(3)


def puts_nan_into_the_world(world):
    world._shift([0], np.array([0.0, float("nan"), 0.0]))
    world.arrangement_changed()


def changes_what_it_was_asked_about(world):
    world._shift([0], np.array([0.0, 0.1, 0.0]))
    world.arrangement_changed()


def changes_settings_and_refuses(world):
    world.configure(grid_size=world.settings.grid_size + 0.1)
    raise ActionFailed("no")


def refuses_at_length(world):
    raise ActionFailed("no " * 1000)


def refuses_in_two_lines(world):
    raise ActionFailed("no\nand no")


def walks_through_a_wall(world):
    far = world.agent.position + np.array([50.0, 0.0, 0.0])
    world.place_agent(replace(world.agent, position=far))


def changes_behind_the_cache(world):
    world.mass[0] += 1.0


@pytest.mark.parametrize(
    ("broken", "action", "found"),
    [
        (raises, "Pass", r"raised at registry.py:\d+: ZeroDivisionError: no clean refusal"),
        (warns, "Pass", r"warned at test_fuzz.py:\d+: said on stderr"),
        (returns_nan, "Pass", r"not valid JSON: .*, at \.actionReturn\.poses\[1\] = nan"),
        (returns_an_array, "Pass", "cannot be packed"),
        (puts_nan_into_the_world, "Crouch", "NaN or infinite"),
        (changes_what_it_was_asked_about, "Pass", "Pass, which changes nothing, changed objects"),
        (changes_settings_and_refuses, "Crouch", "changes nothing, changed Settings"),
        (refuses_at_length, "Crouch", "errorMessage has 3000 characters"),
        (refuses_in_two_lines, "Crouch", "errorMessage has 2 lines"),
        (walks_through_a_wall, "Crouch", "m off the floor"),
        (changes_behind_the_cache, "Pass", r"\.mass is .*, but the cache has"),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_a_broken_engine_is_found(monkeypatch, broken, action, found):
    run_instead(monkeypatch, action, broken)
    monkeypatch.setattr("benchmarks.checks.fuzz_requests.NAMES", [action, "Done"])
    total = played(FuzzPlan(seed=0, actions=60, scenes=("FloorPlan402",)))
    assert any(re.search(found, problem) for step in total.wrong for problem in step.problems)


def test_a_failed_action_that_leaves_a_trace_is_found(monkeypatch):
    def half_done(world, **rest):
        world.set_state(0, "isOpen", not world.state(0, "isOpen"))
        raise ActionFailed("cannot")

    run_instead(monkeypatch, "OpenObject", half_done)
    monkeypatch.setattr("benchmarks.checks.fuzz_requests.NAMES", ["OpenObject"])
    total = played(FuzzPlan(seed=0, actions=10, scenes=("FloorPlan402",)))
    problems = [problem for step in total.wrong for problem in step.problems]
    assert any("a refused action changed" in problem for problem in problems)


def test_a_client_that_raises_the_wrong_thing_is_found(monkeypatch):
    class Timid(fuzz_script.EmbeddedController):
        def step(self, *args, **kwargs):
            kwargs["raise_for_failure"] = False
            return super().step(*args, **kwargs)

    monkeypatch.setattr(fuzz_script, "EmbeddedController", Timid)
    monkeypatch.setattr("benchmarks.checks.fuzz_requests.NAMES", ["Stand"])
    total = played(FuzzPlan(seed=0, actions=2000, scenes=("FloorPlan402",)), [9])
    assert any("raised None, not <class 'RuntimeError'>" in str(step) for step in total.wrong)


def test_the_game_goes_on_after_an_exception(monkeypatch):
    metadata = engine_module.metadata

    def sometimes(world, action, *rest):
        if action == "Done":
            raise KeyError(action)
        return metadata(world, action, *rest)

    monkeypatch.setattr(engine_module, "metadata", sometimes)
    monkeypatch.setattr("benchmarks.checks.fuzz_requests.NAMES", ["Done", "Pass"])
    total = played(FuzzPlan(seed=0, actions=40, scenes=("FloorPlan402",)))
    assert total.total.tries == 40
    assert total.tallies["Pass"].successes > 5
    assert total.tallies["Done"].problems > 5


def test_bad_values_are_told_by_where_they_are():
    told = list(can_be_serialised({"a": [{"b": float("inf")}], "c": 10**30}))
    assert any(".a[0].b = inf" in problem for problem in told)
    assert any("OverflowError" in problem for problem in told)
    assert list(can_be_serialised({"name": "\ud800", "n": [1, 2.5, None, True]})) == []


def test_bad_pictures_are_found():
    size = {"screenWidth": 4, "screenHeight": 3}
    depth = np.full((3, 4), np.inf, dtype=np.float32)
    assert list(pictures_fit([np.zeros((3, 4, 3), np.uint8), depth], size)) == []
    depth[1, 1] = np.nan
    assert len(list(pictures_fit([np.zeros((4, 3, 3), np.uint8), depth], size))) == 2


def test_questions_are_actions():
    assert ACTIONS.keys() >= QUESTIONS


# -- the command -----------------------------------------------------------------------------------


def test_problems_are_shown_with_the_way_to_see_them_again(monkeypatch, capsys):
    run_instead(monkeypatch, "Pass", raises)
    monkeypatch.setattr("benchmarks.checks.fuzz_requests.NAMES", ["Pass"])
    plan = FuzzPlan(seed=5, actions=8, scenes=("FloorPlan402",), agents=2)
    assert show(played(plan), plan, 1.0) == 1
    shown = capsys.readouterr().out
    assert "in FloorPlan402: {'action': 'Pass'" in shown
    assert "--actions 8 --seed 5 --scenes FloorPlan402 --agents 2 --run 0" in shown
    assert "more where: raised at registry.py:" in shown
    assert "BROKEN: 8 actions" in shown


def test_the_command_plays_a_run_step_by_step():
    ran = CliRunner().invoke(
        main, ["--seed", "3", "--actions", "30", "--scenes", "3", "--run", "0"]
    )
    assert ran.exit_code == 0, ran.output
    assert "run 0 step 29 in FloorPlan" in ran.output
    assert re.search(r"ok: 30 actions .* seed 3, fingerprint [0-9a-f]{8}, problems 0", ran.output)


@pytest.mark.parametrize("arguments", [["--run", "9", "--actions", "100"], ["--scenes", "Kitchen"]])
def test_bad_input_is_reported(arguments):
    assert CliRunner().invoke(main, arguments).exit_code == 2


def test_an_interrupted_play_is_summed_up(monkeypatch):
    def interrupted(plan, workers):
        yield play_run(0, plan=replace(plan, actions=5))
        raise KeyboardInterrupt

    monkeypatch.setattr(fuzz_script, "fuzz", interrupted)
    ran = CliRunner().invoke(main, ["--scenes", "3", "--seed", "3"])
    assert ran.exit_code == 130
    assert "interrupted; so far:" in ran.output
    assert "ok: 5 actions" in ran.output


# -- several agents ----------------------------------------------------------------------------


def test_several_agents_play_without_a_problem():
    report = play_run(0, plan=FuzzPlan(seed=2, actions=60, scenes=("FloorPlan403",), agents=4))
    assert not report.wrong
    assert report.total.tries == 60


def test_two_agents_may_both_hold_something():
    engine, checker = Engine(32, 24), CompanyChecker()
    told(engine, action="Reset", sceneName="FloorPlan1")
    told(engine, action="Initialize", agentCount=2)
    for number, kind in enumerate(("Apple", "Mug")):
        thing = engine.world.object_ids[engine.world.types.index(kind)]
        request = {"action": "PickupObject", "objectId": thing, "forceAction": True}
        seen = told(engine, agentId=number, **request)
        assert seen[0][0]["inventoryObjects"]
        assert not list(checker.sees(request, seen, engine.world))


def told(engine, **request):
    """What each agent is told after a request, first the one that acted."""
    metadata, _ = engine.step({"renderImage": False, **request})
    every = [dict(metadata), *(dict(each.metadata) for each in engine.bystanders)]
    return [(each, ()) for each in every]


@pytest.mark.parametrize(
    ("spoil", "found"),
    [
        (lambda acted, other: other["agent"]["position"].update(x=9.0), "agent 1 did not act"),
        (lambda acted, other: acted["agent"]["position"].update(z=0.1), "a step ends 0.100 m"),
        (lambda acted, other: other.update(fov=50), "changed fov"),
        (
            lambda acted, other: other.update(
                inventoryObjects=[{"objectId": "Apple|1", "objectType": "Apple"}]
            ),
            "the hand holds",
        ),
    ],
)
def test_what_is_wrong_about_several_agents_is_found(spoil, found):
    engine, checker = Engine(32, 24), CompanyChecker()
    told(engine, action="Reset", sceneName="FloorPlan1")
    told(engine, action="Initialize", agentCount=2)
    problems = list(checker.sees({}, told(engine, action="Pass"), engine.world))
    assert not problems
    # A refused step, which its metadata call a success to be checked as one.
    seen = told(engine, action="MoveAhead", moveMagnitude=50)
    seen[0][0].update(
        lastActionSuccess="step" in found, errorMessage="" if "step" in found else "x"
    )
    spoil(seen[0][0], seen[1][0])
    assert [each for each in checker.sees({}, seen, engine.world) if found in each]
