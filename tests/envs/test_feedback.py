"""What agents are told of actions that were not done: plain words, in both languages."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import pytest

from er_gym.envs import thor_errors
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.feedback import as_now, failed, told_in
from er_gym.envs.feedback_words import SENTENCES
from er_gym.envs.paper_action_handler import NO_OBJECT
from er_gym.envs.thor_errors import problem_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES, make_controller

INTERNAL = re.compile(
    r"_[0-9a-f]{8}|\||\d\.\d|agent \d|agent's|exception|forceaction|objectid|ai2-thor|floorplan",
    re.IGNORECASE,
)
"""What only the simulator's own messages say."""
CHINESE = re.compile(r"[\u4e00-\u9fff]")
LATIN = re.compile(r"[A-Za-z]+")
NAMES = {
    *OBJECT_TYPES,
    *NO_OBJECT.split(),
    *(word for verb in verbs.table() for word in verb.name.split()),
}
TABLE = (
    ("Bed_3b160ca2 is blocking Agent 0 from moving by (-0.1000, 0.0000, 0.0000).",
     "Bed is in the way"),
    ("FP301:Bed_3b160ca2 is blocking Agent 0 from moving by (-0.1000, 0.0000, 0.0000).",
     "Bed is in the way"),
    ("A wall is blocking Agent 0 from moving by (0.0000, 0.0000, 0.1000).", "a wall is in the way"),
    ("StandardIslandHeight is blocking Agent 0 from moving by (0.0000, 0.0000, 0.1000).",
     "something is in the way"),
    ("Agent 1 is blocking Agent 0 from moving by (0.0000, 0.0000, 0.1000).",
     "something is in the way"),
    ("Cannot teleport to (1.250, -0.500): Sofa_0a1b2c3d is there. GetReachablePositions lists "
     "where the agent can stand.", "Sofa is in the way"),
    ("Cannot teleport due to hand object collision.", "what you hold would hit something"),
    ("Picking up object would cause it to collide and clip into something!",
     "something is in the way"),
    ("Teleport position (9.000000, 0.900000, 9.000000) out of scene bounds! Ignore this by setting "
     "forceAction=true.", "there is no room to stand there"),
    ("NullReferenceException: Target object not found within the specified visibility. "
     "Mug|+01.00|+00.90|-01.00 is inside Cabinet|+01.00|+00.50|-01.00, which is closed.",
     "it is inside Cabinet, which is closed"),
    ("NullReferenceException: Target object not found within the specified visibility. "
     "Mug|+01.00|+00.90|-01.00 is out of view, farther than 1.5 m, or hidden.",
     "it is out of view, too far away, or behind something"),
    ("NullReferenceException: Target object not found within the specified visibility.\n"
     "  at UnityStandardAssets.PhysicsRemoteFPSAgentController.target () [0x00000]",
     "it is out of view, too far away, or behind something"),
    ("The agent's hand holds Apple|+01.00|+00.90|-01.00 already; put it down first.",
     "you hold Apple already"),
    ("Agent hand has something in it already! Can't pick up anything else",
     "you hold something already"),
    ("The agent's hand is empty: pick something up first.", "you hold nothing"),
    ("Plate|+01.00|+00.90|-01.00 is in the agent's own hand.", "it is in your own hand"),
    ("Bread|+01.00|+00.90|-01.00 is in the agent's hand; put it down before slicing it.",
     "it is in your own hand"),
    ("Fridge|+01.00|+00.90|-01.00 is closed; open it before putting something into it.",
     "Fridge is closed; open it first"),
    ("Target openable Receptacle is CLOSED, can't place if target is not open!",
     "it is closed; open it first"),
    ("A Toaster does not take a Mug.", "Mug does not go there"),
    ("Mug_3b160ca2 is not a valid Object Type to be placed in Toaster_0a1b2c3d",
     "what you hold does not go there"),
    ("No valid positions to place Mug: SideTable|+11.38|+00.00|-01.16 has no free space.",
     "there is no free space for it"),
    ("Apple|+01.00|+00.90|-01.00 is not a receptacle.", "nothing can be put there"),
    ("Microwave|+01.00|+00.90|-01.00 is on; switch it off before opening it.",
     "it is on; switch it off first"),
    ("Target must be OFF to open!", "it is on; switch it off first"),
    ("Microwave|+01.00|+00.90|-01.00 must be closed before it is switched on.",
     "it is open; close it first"),
    ("StoveBurner|+01.00|+00.90|-01.00 is not toggled itself: turn StoveKnob|-00.48|+00.88|-02.19, "
     "which controls it.", "its switch is a part of its own; use that"),
    ("Fridge|+01.00|+00.90|-01.00 is open already.", "it is open already"),
    ("Fridge|+01.00|+00.90|-01.00 is closed already.", "it is closed already"),
    ("can't toggle object on if it's already on!", "it is on already"),
    ("Faucet|+01.00|+00.90|-01.00 is off already.", "it is off already"),
    ("Bread|+01.00|+00.90|-01.00 is sliced: only its parts are there.", "only its parts are left"),
    ("Mug|+01.00|+00.90|-01.00 is dirty already.", "that is done already"),
    ("Sofa|+01.00|+00.90|-01.00 is not something that can be picked up.",
     "it cannot be picked up"),
    ("CounterTop|-00.08|+01.15|00.00 is not an Openable object", "it does not open or close"),
    ("Sofa|+01.00|+00.90|-01.00 is not a toggleable object.", "it has no switch"),
    ("CounterTop_d7cc8dfe Does not have the CanBeSliced property!", "it cannot be sliced"),
    ("Sofa|+01.00|+00.90|-01.00 is not something that can be sliced.", "it cannot be sliced"),
    ("Not enough clear space to pickup object.", "something is in the way"),
    ("No object with ID 'Mug|+01.00|+00.90|-01.00' is in FloorPlan1.", "it is not there"),
    ("Sofa|+01.00|+00.90|-01.00 is not something that can be dirty.", "that cannot be done to it"),
    ("moveMagnitude must be > 0, not -0.1.", "it did not work"),
    ("IndexOutOfRangeException: Index was outside the bounds of the array.\n at Agent 0 (0.100)",
     "it did not work"),
    ("", "it did not work"),
)  # fmt: skip
"""Messages of the embedded engine and of AI2-THOR's player, and what they mean to an agent."""


def check_words(feedback: str) -> None:
    """Plain in both languages; in Chinese only names are left in Latin letters."""
    chinese = told_in("zh", feedback)
    assert not INTERNAL.search(feedback), feedback
    assert not INTERNAL.search(chinese), chinese
    assert told_in("en", feedback) == feedback == as_now(feedback)
    assert CHINESE.search(chinese), chinese
    assert {*LATIN.findall(chinese)} <= NAMES, chinese


@pytest.mark.parametrize(("message", "plain"), TABLE)
def test_a_message_of_the_simulator_is_told_in_plain_words(message: str, plain: str) -> None:
    assert problem_of(message) == plain
    told = failed("pickup Mug", "", message)
    assert told == f"You could not pickup Mug: {plain}."
    check_words(told)


def test_each_row_of_the_table_is_met() -> None:
    lines = [message.partition("\n")[0] for message, _ in TABLE]
    met = {
        next((row for row in thor_errors._ROWS if row.pattern.search(line)), None) for line in lines
    }
    assert not [row.pattern.pattern for row in thor_errors._ROWS if row not in met]


def test_all_sentences_have_the_same_slots_in_both_languages() -> None:
    for each in SENTENCES:
        slots = [{*re.findall(r"\{(\w+)\}", text)} for text in (each.en, each.zh)]
        assert slots[1] <= slots[0], each
        assert slots[0] - slots[1] <= {"tool"}, each
        assert CHINESE.search(each.zh)


def test_the_feedback_that_verbs_state_is_known_in_chinese() -> None:
    for verb in verbs.OWN:
        if verb.otherwise:
            check_words(f"You cannot {verb.name}. {verb.otherwise}")


def test_older_recordings_are_told_in_todays_words() -> None:
    for recorded, now in (
        ("You could not move forward: Bed_3b160ca2 is blocking Agent 0 from moving by (0.1, 0, 0).",
         "You could not move forward: Bed is in the way."),
        ("You could not open Fridge: your hand slipped, and it is still closed",
         "You could not open Fridge: your hand slipped, and it is still closed."),
        ("You could not find it: |", "You could not find it: |"),
        ("After your navigate to Shelf, nothing moved.",
         "After your navigate to Shelf, nothing moved."),
    ):  # fmt: skip
        assert as_now(recorded) == now
        assert as_now(now) == now


def test_a_text_that_is_not_the_environments_stays() -> None:
    for text in ("After your navigate to Shelf, nothing moved.", "没有成功。", ""):
        assert told_in("zh", text) == text


def refusals() -> Iterator[str]:
    """The engine's messages on what skills may ask of it, with what stands in a kitchen."""
    actions = ("PickupObject", "PutObject", "OpenObject", "CloseObject", "SliceObject")
    asked = [*product((*actions, "ToggleObjectOn", "ToggleObjectOff"), (False, True))]
    with make_controller(scene="FloorPlan1", gridSize=0.25, headless=True) as controller:
        objects = controller.last_event.metadata["objects"]
        for _, (action, forced) in product(range(2), asked):
            for entry in objects[::4]:
                event = controller.step(
                    action=action, objectId=entry["objectId"], forceAction=forced
                )
                yield event.metadata["errorMessage"]
        for x, z in product((-9.0, -0.5, 0.0, 0.5), repeat=2):
            event = controller.step("Teleport", position={"x": x, "y": 0.9, "z": z})
            yield event.metadata["errorMessage"]
            yield controller.step("MoveAhead", moveMagnitude=0.5).metadata["errorMessage"]


def test_no_refusal_of_the_engine_is_unknown_or_told_as_it_is() -> None:
    messages = {*refusals()} - {""}
    kinds = {problem_of(message) for message in messages}
    assert "it did not work" not in kinds
    assert len(kinds) > 15
    for message in messages:
        check_words(failed("open Fridge", "", message))


@pytest.mark.parametrize(
    ("episodes", "options"),
    [(3, {"faults": 0.3}), (2, {"protocol": "paper"}), (3, {"instances": "explore"})],
)
def test_whatever_is_played_is_answered_in_plain_words(
    episodes: int, options: dict[str, Any]
) -> None:
    """Half of the actions are legal ones, the others are drawn from all, and steps forward."""
    random, failures, raw = np.random.default_rng(7), 0, 0
    with EmbodiedEnv("mini", obs_mode="state", **options) as env:
        for seed in range(episodes):
            _, info = env.reset(seed=seed)
            over = False
            while not over:
                legal = np.flatnonzero(info["action_mask"])
                drawn = (int(random.choice(legal)), int(random.integers(len(ACTIONS))))
                action = ACTIONS[drawn[int(random.random() < 0.5)]]
                said = "move forward" if random.random() < 0.3 else str(action)
                _, _, ended, cut, info = env.step(said)
                over = ended or cut
                check_words(info["feedback"])
                failures += not info["action_success"]
                raw += bool(info["error_message"])
                if info["error_message"]:
                    assert not info["action_success"]
    assert failures > 5
    assert raw


def test_info_has_the_simulators_message() -> None:
    with EmbodiedEnv("mini", obs_mode="state+text") as env:
        _, info = env.reset(seed=0)
        assert info["error_message"] == ""
        while info["action_success"]:
            env.step("observe")  # the fourth same action in a row would end the episode
            obs, *_, info = env.step("move forward")
        assert re.search(r"is blocking Agent 0 from moving by \(", info["error_message"])
        assert re.fullmatch(r"You could not move forward: .+ in the way\.", info["feedback"])
        assert not INTERNAL.search(obs["text"].partition("\n")[2].partition("\n")[0])
        again = env.restore(env.snapshot())[1]
        assert again["error_message"] == info["error_message"]
