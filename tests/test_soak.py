"""The soak's invariants: each finds the faults that it is for, and the engine passes them."""

from __future__ import annotations

import copy
import re
import subprocess
import sys

import pytest
from floor_plan_1 import APPLE, BOWL, EGG, FRIDGE, ISLAND

from benchmarks.checks import soak as soak_script
from benchmarks.checks.invariants import (
    INVARIANTS,
    a_refusal_changed_nothing,
    broken,
    floor_of,
    stands_on_the_floor,
)
from benchmarks.checks.scene_jobs import choose_scenes
from benchmarks.checks.soak import SoakReport, soak, soak_scene, verdict
from benchmarks.perf import steps as steps_script
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.thor import SCENE_NAMES, make_controller


@pytest.fixture(scope="module")
def recorded():
    """FloorPlan1's metadata with a bowl in hand and an apple in the bowl."""
    controller = make_controller(scene="FloorPlan1", headless=True)
    for action, thing in (("PickupObject", APPLE), ("PutObject", BOWL), ("PickupObject", BOWL)):
        event = controller.step(
            action=action, objectId=thing, forceAction=True, raise_for_failure=True
        )
    controller.stop()
    return copy.deepcopy(dict(event.metadata))


@pytest.fixture
def metadata(recorded):
    return copy.deepcopy(recorded)


def entry(metadata, object_id):
    return next(e for e in metadata["objects"] if e["objectId"] == object_id)


def test_sound_metadata_break_nothing(metadata):
    assert broken(metadata) == []


def setting(object_id, key, value):
    """Damages metadata: an object gets a wrong value."""

    def damage(m):
        entry(m, object_id)[key] = value

    damage.__name__ = f"{object_id}'s {key} {value}"
    return damage


def listed_twice(m):
    m["objects"].append(entry(m, FRIDGE))


def not_listed_by_its_receptacle(m):
    entry(m, BOWL)["receptacleObjectIds"].remove(APPLE)


def listed_by_another_receptacle(m):
    entry(m, ISLAND)["receptacleObjectIds"].append(APPLE)


def in_what_is_not_there(m):
    entry(m, APPLE)["parentReceptacles"].append("Box|0|0|0")


def two_in_hand(m):
    m["inventoryObjects"].append({"objectId": EGG, "objectType": "Egg"})


def slice_beside_the_whole(m):
    m["objects"].append({**entry(m, EGG), "objectId": f"{APPLE}|AppleSliced_2"})


def nowhere(m):
    entry(m, EGG)["position"]["y"] = float("nan")


def box_without_end(m):
    entry(m, EGG)["axisAlignedBoundingBox"]["cornerPoints"][3][1] = float("inf")


def agent_nowhere(m):
    m["agent"]["position"]["x"] = float("nan")


def tuple_in_it(m):
    m["actionReturn"] = (1, 2)


def failed_without_a_word(m):
    m["lastActionSuccess"] = False


@pytest.mark.parametrize(
    ("damage", "found"),
    [
        (listed_twice, "ids_are_unique"),
        (not_listed_by_its_receptacle, "contents_agree"),
        (listed_by_another_receptacle, "contents_agree"),
        (in_what_is_not_there, "contents_agree"),
        (setting(BOWL, "parentReceptacles", [APPLE]), "nothing_contains_itself"),
        (two_in_hand, "hand_agrees"),
        (setting(BOWL, "isPickedUp", False), "hand_agrees"),
        (setting(EGG, "isPickedUp", True), "hand_agrees"),
        (setting(BOWL, "parentReceptacles", [ISLAND]), "hand_agrees"),
        (setting(EGG, "visible", True), "closed_things_hide_their_contents"),
        (setting(EGG, "isInteractable", True), "closed_things_hide_their_contents"),
        (setting(BOWL, "parentReceptacles", [FRIDGE]), "closed_things_hide_their_contents"),
        (slice_beside_the_whole, "wholes_are_gone"),
        (nowhere, "numbers_are_finite"),
        (box_without_end, "numbers_are_finite"),
        (agent_nowhere, "numbers_are_finite"),
        (tuple_in_it, "values_are_plain"),
        (failed_without_a_word, "failures_say_why"),
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_an_invariant_finds(metadata, damage, found):
    damage(metadata)
    problems = {invariant.__name__: list(invariant(metadata)) for invariant in INVARIANTS}
    assert problems[found]
    assert broken(metadata)


def test_every_invariant_is_tried_above():
    marks = test_an_invariant_finds.pytestmark[0].args[1]
    assert {name for _, name in marks} == {invariant.__name__ for invariant in INVARIANTS}


def test_an_agent_off_the_floor_is_found(metadata):
    here = metadata["agent"]["position"]
    floor = floor_of([{**here, "x": here["x"] + away} for away in (0.07, 1.0)])
    assert list(stands_on_the_floor(metadata, floor)) == []
    assert list(stands_on_the_floor(metadata, floor[1:]))


def test_a_refusal_that_left_a_trace_is_found(metadata):
    after = copy.deepcopy(metadata)
    after.update(lastActionSuccess=False, errorMessage="no")
    assert list(a_refusal_changed_nothing(metadata, after)) == []
    entry(after, EGG)["isBroken"] = True
    assert EGG in next(a_refusal_changed_nothing(metadata, after))
    after["lastActionSuccess"] = True
    assert list(a_refusal_changed_nothing(metadata, after)) == []


# -- playing ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", SCENE_NAMES)
def test_random_engine_actions_break_nothing(scene):
    report = soak_scene(scene, level="engine", actions=20, seed=0)
    assert report.problem == ""
    assert report.actions == 20


@pytest.mark.parametrize("scene", choose_scenes("12"))
def test_random_legal_actions_break_nothing(scene):
    report = soak_scene(scene, level="env", actions=40, seed=0)
    assert report.problem == ""
    assert report.succeeded > 20


@pytest.mark.parametrize("level", ["env", "engine"])
def test_a_seed_plays_the_same_again(level):
    def played(seed):
        steps = soak_script.LEVELS[level]("FloorPlan5", seed)
        whats = [next(steps)[0] for _ in range(15)]
        steps.close()
        return whats

    assert played(3) == played(3)
    assert played(3) != played(4)


def test_workers_play_every_scene():
    scenes = ["FloorPlan401", "FloorPlan402", "FloorPlan403"]
    reports = list(soak(scenes, level="engine", actions=5, seed=0, workers=2))
    assert sorted(report.scene for report in reports) == scenes
    assert all(report.actions == 5 and not report.problem for report in reports)


def test_what_is_raised_is_a_problem_with_its_step(monkeypatch):
    def play(scene, seed):
        yield "Pass", {"lastActionSuccess": True}, []
        raise TypeError("no list of dictionaries")

    monkeypatch.setitem(soak_script.LEVELS, "engine", play)
    report = soak_scene("FloorPlan1", level="engine", actions=5, seed=0)
    assert report.problem == "at action 2: TypeError: no list of dictionaries"


def test_the_verdict_says_how_to_see_it_again(capsys):
    reports = [
        SoakReport("FloorPlan2", 7, 5, 0.1, "after action 7, Pass {}: wrong"),
        SoakReport("FloorPlan1", 10, 9, 0.1),
    ]
    assert verdict(reports, level="engine", actions=10, seed=4) == 1
    said = capsys.readouterr()
    assert "FloorPlan2 after action 7, Pass {}: wrong" in said.err
    assert "--level engine --seed 4 --actions 10 --scenes FloorPlan2" in said.err
    assert said.out.startswith("BROKEN: 2 scenes, 17 engine actions")
    assert verdict(reports[1:], level="engine", actions=10, seed=4) == 0
    assert capsys.readouterr().out.startswith("ok: 1 scenes")


def test_scenes_are_chosen_by_number_or_name():
    assert choose_scenes("all") == list(SCENE_NAMES)
    assert choose_scenes("4") == ["FloorPlan1", "FloorPlan201", "FloorPlan301", "FloorPlan401"]
    assert choose_scenes("FloorPlan7,FloorPlan230") == ["FloorPlan7", "FloorPlan230"]


@pytest.mark.parametrize("asked", ["0", "121", "FloorPlan31", "some", ""])
def test_other_scenes_are_bad_input(asked):
    command = [sys.executable, "-m", "benchmarks.checks.soak", "--scenes", asked]
    with pytest.raises(ValueError, match="--scenes takes"):
        choose_scenes(asked)
    if asked == "0":  # once is enough for a process
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        assert result.returncode == 2
        assert "--scenes takes" in result.stderr


# -- the speed benchmark ---------------------------------------------------------------------------


def test_steps_are_counted_over_episodes():
    env = EmbodiedEnv(obs_mode="state")
    player = steps_script.RandomPlayer([env, env], seed=0)
    assert player.steps_per_second(0.2) > 5
    assert player.resets
    env.close()


def test_the_table_names_what_was_measured(capsys):
    steps_script.show([steps_script.Measurement.of("steps, none", [3.0, 1.0, 2.0], "steps/s")])
    said = capsys.readouterr().out
    assert re.search(r"steps, none\W+2\.00\W+steps/s\W+3\.00  1\.00  2\.00", said)
    assert "MiniGrid is not installed" in said
