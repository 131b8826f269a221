"""The paper's rules of interaction, played in a real kitchen (FloorPlan1)."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from floor_plan_1 import APPLE, CABINET, CUP, EGG, FRIDGE
from support import Play, make_task

from er_gym.envs.actions import ACTIONS, INDEX, Action, parse
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.task import AgentPose

FETCH_CUP = make_task(
    "single_pickup_from_closerep",
    ("navigate to", CABINET),
    ("open", CABINET),
    ("pickup", CUP),
    ("close", CABINET),
    target_objects=(CABINET,),
    related_objects=(CUP,),
    navigable_objects=("Cabinet",),
)


def test_start_is_a_corner_looking_diagonally_in(env: EmbodiedEnv, play: Play) -> None:
    play(FETCH_CUP)
    agent = env._controller.last_event.metadata["agent"]
    bounds = env._controller.last_event.metadata["sceneBounds"]
    assert agent["rotation"]["y"] in (45, 135, 225, 315)
    assert agent["cameraHorizon"] == 0
    to_middle = np.array([bounds["center"][a] - agent["position"][a] for a in "xz"])
    heading = np.radians(agent["rotation"]["y"])
    assert to_middle @ [np.sin(heading), np.cos(heading)] > 0


def test_the_whole_task_is_worth_its_key_actions(play: Play) -> None:
    infos = play(
        FETCH_CUP, "navigate to Cabinet", "open Cabinet", "pickup Cup", "close Cabinet", "end"
    )
    assert [info["reward"] for info in infos[1:]] == [1.0] * 5
    assert infos[-1]["success"]
    assert infos[-1]["ended"]
    assert not infos[-1]["cut"]
    assert infos[-1]["keys_left"] == ()
    assert infos[-1]["end_reason"] == "end"


def test_end_before_the_task_is_done_is_worth_nothing(play: Play) -> None:
    infos = play(FETCH_CUP, "navigate to Cabinet", "end")
    assert infos[-1]["reward"] == 0.0
    assert infos[-1]["ended"]
    assert not infos[-1]["success"]


def test_navigation_is_not_needed_for_success(play: Play) -> None:
    task = make_task("single_pickup", ("navigate to", FRIDGE), ("pickup", APPLE))
    infos = play(task, "navigate to CounterTop", "pickup Apple", "end")
    assert infos[-1]["success"]
    assert [key.verb for key in infos[-1]["keys_left"]] == ["navigate to"]


def test_a_key_action_counts_once(play: Play) -> None:
    task = make_task("single_pickup_from_closerep", ("open", FRIDGE), ("pickup", EGG))
    infos = play(task, "navigate to Fridge", "open Fridge", "close Fridge", "open Fridge")
    assert [info["reward"] for info in infos[1:]] == [0.0, 1.0, 0.0, 0.0]


def test_order_matters_only_where_the_type_is_ordered(play: Play) -> None:
    steps = (("close", FRIDGE), ("open", FRIDGE))
    free = make_task("single_pickup_from_closerep", *steps)
    strict = make_task("ordered_pickup_two_object_and_put", *steps)
    actions = ("navigate to Fridge", "open Fridge", "close Fridge")
    assert [info["reward"] for info in play(free, *actions)[1:]] == [0.0, 1.0, 1.0]
    assert [info["reward"] for info in play(strict, *actions)[1:]] == [0.0, 0.0, 1.0]


def test_a_search_ends_well_only_in_sight_of_its_target(play: Play) -> None:
    task = make_task("single_search_from_closerep", ("open", FRIDGE), related_objects=(EGG,))
    assert play(task, "navigate to Fridge", "open Fridge", "end")[-1]["success"]
    gone = play(task, "navigate to Fridge", "open Fridge", "navigate to Window", "end")
    assert not gone[-1]["success"]


def test_an_illegal_action_costs_a_step_and_changes_nothing(env: EmbodiedEnv, play: Play) -> None:
    before, after = play(FETCH_CUP, "open Microwave")
    assert after["steps"] == before["steps"] + 1
    assert not after["action_success"]
    assert after["reward"] == 0.0
    assert "cannot open Microwave" in after["feedback"]
    assert after["action_mask"].tolist() == before["action_mask"].tolist()


def test_penalties() -> None:
    env = EmbodiedEnv([FETCH_CUP], obs_mode="text", step_penalty=0.25, illegal_penalty=0.5)
    env.reset()
    assert env.step("pickup Cup")[1] == -0.75
    assert env.step("navigate to Cabinet")[1] == 0.75
    env.close()


def test_the_fourth_same_action_ends_the_episode_unexecuted(play: Play) -> None:
    infos = play(FETCH_CUP, *["move forward"] * 4)
    assert [info["ended"] for info in infos[1:]] == [False, False, False, True]
    assert infos[-1]["end_reason"] == "repeated action"
    assert infos[-1]["steps"] == infos[-2]["steps"] == 4


def test_three_replies_without_an_action_end_the_episode_and_cost_no_step(play: Play) -> None:
    infos = play(FETCH_CUP, "hmm", "observe", "dance", "navigate to Narnia", "")
    assert [info["ended"] for info in infos[1:]] == [False, False, False, False, True]
    assert infos[-1]["end_reason"] == "no known action"
    assert infos[-1]["steps"] == 2
    assert infos[1]["action"] == infos[1]["verb"] == ""
    assert "names no action" in infos[1]["feedback"]


def test_the_step_limit_truncates_and_counts_the_placing(env: EmbodiedEnv) -> None:
    env.reset(options={"task": FETCH_CUP})
    for number in range(1, FETCH_CUP.max_steps):
        _, _, ended, cut, info = env.step("observe" if number % 2 else "move forward")
        assert not ended
        assert cut is (number == FETCH_CUP.max_steps - 1 == 23)
    assert info["end_reason"] == "step limit"
    assert info["steps"] == 24


def test_an_ended_episode_takes_no_more_actions(env: EmbodiedEnv, play: Play) -> None:
    play(FETCH_CUP, "end")
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step("observe")


@pytest.mark.parametrize(
    "action",
    [-1, len(ACTIONS), 2.5, None, True, np.array([np.nan]), np.array([True]), [3, 4],
     np.array([3, 4]), np.array([3.0]), b"observe"],
)  # fmt: skip
def test_what_is_no_action_at_all_is_an_error(env: EmbodiedEnv, play: Play, action: object) -> None:
    play(FETCH_CUP)
    with pytest.raises(gymnasium.error.InvalidAction, match="is not an action"):
        env.step(action)  # type: ignore[arg-type]


def test_text_index_and_action_are_one(env: EmbodiedEnv) -> None:
    for action in (
        "navigate to Cabinet",
        "  Navigate  to cabinet",
        Action("navigate to", "Cabinet"),
    ):
        env.reset(options={"task": FETCH_CUP})
        assert env.step(action)[1] == 1.0
    index = INDEX[Action("navigate to", "Cabinet")]
    for action in (index, np.int64(index), np.array(index), np.array([index])):  # as predict says
        env.reset(options={"task": FETCH_CUP})
        assert env.step(action)[1] == 1.0


@pytest.mark.parametrize(
    ("text", "action"),
    [
        ("put Fridge", Action("put in", "Fridge")),
        ("put in fridge", Action("put in", "Fridge")),
        ("pick up APPLE", Action("pickup", "Apple")),
        ("end", Action("end")),
        ("open Apple", None),
        ("navigate to Floor", None),
        ("navigate to", None),
        ("sing", None),
    ],
)
def test_parse(text: str, action: Action | None) -> None:
    assert parse(text) == action


def test_every_action_survives_its_text() -> None:
    assert [parse(str(action)) for action in ACTIONS] == list(ACTIONS)


def test_the_mask_is_what_is_legal(env: EmbodiedEnv, play: Play) -> None:
    """An action is refused exactly if the mask says 0, for all of them."""
    play(FETCH_CUP, "navigate to Fridge", "open Fridge", "pickup Egg")
    mask = env.action_masks()
    assert mask.dtype == np.int8
    for index, action in enumerate(ACTIONS):
        play(FETCH_CUP, "navigate to Fridge", "open Fridge", "pickup Egg")
        _, _, _, _, info = env.step(index)
        refused = info["feedback"].startswith(("You cannot", "You hold", "Your hand"))
        assert refused == (mask[index] == 0), (action, info["feedback"])


def test_what_was_navigable_once_stays_so(env: EmbodiedEnv, play: Play) -> None:
    first, _, last = play(FETCH_CUP, "navigate to Fridge", "navigate to Cabinet")
    in_view = {
        o["objectType"] for o in env._controller.last_event.metadata["objects"] if o["visible"]
    }
    assert set(first["navigable"]) <= set(last["navigable"])
    assert "GarbageCan" in first["navigable"]
    assert "GarbageCan" not in in_view


def test_observe_gives_three_views_and_turns_back(play: Play) -> None:
    env = EmbodiedEnv([FETCH_CUP], obs_mode="rgb", width=96, height=64)
    obs, _ = env.reset()
    after, *_ = env.step("observe")
    views = env.details["views"]
    assert set(views) == {"left", "behind", "right"}
    assert all(view.shape == (64, 96, 3) for view in views.values())
    assert (after["rgb"] == obs["rgb"]).all()
    assert not (views["left"] == views["right"]).all()
    env.close()


def test_what_is_seen_when_looking_round_is_known_from_then_on(play: Play) -> None:
    *_, before, after = play(FETCH_CUP, "navigate to Fridge", "observe")
    assert set(before["navigable"]) < set(after["navigable"])
    assert before["interactable"] == after["interactable"]  # it looks ahead again


def test_going_to_an_open_receptacle_means_going_to_the_related_object_in_it(
    env: EmbodiedEnv, play: Play
) -> None:
    def distance_to(object_id: str) -> float:
        objects = {o["objectId"]: o for o in env._controller.last_event.metadata["objects"]}
        at = env._controller.last_event.metadata["agent"]["position"]
        thing = objects[object_id]["axisAlignedBoundingBox"]["center"]
        return float(np.hypot(thing["x"] - at["x"], thing["z"] - at["z"]))

    counter = "CounterTop|-01.87|+00.95|-01.21"
    potato = "Potato|-01.66|+00.93|-02.15"
    lead = make_task("single_pickup", ("navigate to", counter), related_objects=(potato,))
    play(lead, "navigate to CounterTop")
    assert distance_to(potato) < 1.0
    plain = make_task("single_pickup", ("navigate to", counter))
    play(plain, "navigate to CounterTop")
    assert distance_to(potato) > 1.0


def test_a_stated_pose_is_taken(env: EmbodiedEnv, play: Play) -> None:
    pose = AgentPose(0.25, 0.900999, -1.5, 180.0)
    task = make_task(
        "single_pickup", ("open", CABINET), navigable_objects=("Cabinet",), poses={CABINET: pose}
    )
    play(task, "navigate to Cabinet")
    agent = env._controller.last_event.metadata["agent"]
    assert (agent["position"]["x"], agent["position"]["z"]) == (0.25, -1.5)
    assert agent["rotation"]["y"] == 180.0


def test_target_instances_look_at_the_task(play: Play) -> None:
    for cabinet in (CABINET, "Cabinet|-01.18|+00.50|-02.20"):
        task = make_task("single_pickup", ("open", cabinet), navigable_objects=("Cabinet",))
        assert play(task, "navigate to Cabinet", "open Cabinet")[-1]["object_id"] == cabinet


def test_explore_goes_round_the_instances_nearest_first_whatever_the_task() -> None:
    visits = []
    for cabinet in (CABINET, "Cabinet|-01.18|+00.50|-02.20"):
        task = make_task("single_pickup", ("open", cabinet), navigable_objects=("Cabinet",))
        env = EmbodiedEnv([task], obs_mode="text", instances="explore")
        env.reset()
        seen = []
        for _ in range(10):
            seen.append(env.step("navigate to Cabinet")[4]["object_id"])
            env.step("observe")
        visits.append(seen)
        env.close()
    assert visits[0] == visits[1]
    assert len(set(visits[0][:9])) == 9  # FloorPlan1 has nine cabinets
    assert visits[0][9] in visits[0][:9]


def test_toggling_a_burner_turns_its_knob(env: EmbodiedEnv, play: Play) -> None:
    task = make_task(
        "single_toggle",
        ("toggle", "StoveBurner|-00.47|+00.92|-02.37"),
        navigable_objects=("StoveBurner",),
    )
    infos = play(task, "navigate to StoveBurner", "toggle StoveBurner")
    assert infos[-1]["action_success"]
    assert infos[-1]["reward"] == 1.0
    knobs = [
        o
        for o in env._controller.last_event.metadata["objects"]
        if "StoveBurner|-00.47|+00.92|-02.37" in (o["controlledObjects"] or ())
    ]
    assert [knob["isToggled"] for knob in knobs] == [True]


def test_the_burner_under_a_pan_is_toggled_though_the_pan_hides_it(
    env: EmbodiedEnv, play: Play
) -> None:
    pan, burner = "Pan|-01.29|+00.90|-01.35", "StoveBurner|+01.77|+00.90|+00.82"
    task = make_task(
        "pickup_and_put",
        ("pickup", pan),
        ("put in", burner),
        ("toggle", burner),
        scene="FloorPlan2",
        navigable_objects=("CounterTop", "Pan", "StoveBurner"),
    )
    *_, before, after = play(
        task,
        *("navigate to Pan", "pickup Pan", "navigate to StoveBurner", "put in StoveBurner"),
        *("navigate to Pan", "toggle StoveBurner"),
    )
    assert before["action_mask"][INDEX[Action("toggle", "StoveBurner")]]
    assert after["object_id"] == burner
    objects = {entry["objectId"]: entry for entry in env.objects}
    assert not objects[burner]["visible"]
    knobs = [o for o in env.objects if burner in (o["controlledObjects"] or ())]
    assert [knob["isToggled"] for knob in knobs] == [True]
    far = play(task, "observe")[-1]
    assert not far["action_mask"][INDEX[Action("toggle", "StoveBurner")]]


def test_a_type_with_no_object_left_is_answered_not_raised(env: EmbodiedEnv, play: Play) -> None:
    task = make_task("single_pickup", ("pickup", APPLE), navigable_objects=("Boots",))
    infos = play(task, "navigate to Boots")
    assert "there is no Boots" in infos[-1]["feedback"]
    assert not infos[-1]["action_success"]


def test_choosing_a_task_by_id() -> None:
    env = EmbodiedEnv([FETCH_CUP], obs_mode="text")
    env.reset(options={"task": "test"})
    assert env.task is FETCH_CUP
    with pytest.raises(ValueError, match="no task 'other'"):
        env.reset(options={"task": "other"})
    env.close()


def test_without_tasks_reset_says_so() -> None:
    with pytest.raises(ValueError, match="no tasks"):
        EmbodiedEnv([], obs_mode="text").reset()
