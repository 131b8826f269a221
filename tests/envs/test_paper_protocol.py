"""The paper's protocol, rule by rule, played in a real kitchen (FloorPlan1)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from math import hypot
from types import SimpleNamespace
from typing import Any

import gymnasium
import pytest
from floor_plan_1 import APPLE, BREAD, CABINET, FRIDGE, ISLAND
from support import make_task

from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED, PAPER
from er_gym.envs import skills
from er_gym.envs.actions import ACTIONS, INDEX, NO_ACTION, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.paper_action_handler import NO_OBJECT, parse_action_as_paper
from er_gym.envs.paper_skills import _back_off, observe
from er_gym.envs.protocol import PROTOCOLS
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.paper_format import with_every_pose
from er_gym.tasks.task import AgentPose, Task

TAKE_APPLE = make_task(
    "single_pickup",
    ("navigate to", ISLAND),
    ("pickup", APPLE),
    target_objects=(ISLAND,),
    navigable_objects=("CounterTop", "Fridge"),
)
Play = Callable[..., list[dict[str, Any]]]


@pytest.fixture(scope="module")
def env() -> Iterator[EmbodiedEnv]:
    env = EmbodiedEnv([], obs_mode="state", protocol="paper")
    yield env
    env.close()


@pytest.fixture
def play(env: EmbodiedEnv) -> Play:
    def run(task: Task, *actions: str) -> list[dict[str, Any]]:
        infos = [with_details(env, env.reset(seed=0, options={"task": task})[1])]
        for action in actions:
            _, reward, ended, cut, info = env.step(action)
            infos.append({**with_details(env, info), "reward": reward, "ended": ended, "cut": cut})
        return infos

    return run


class Says:
    """An agent that says what it was given."""

    obs_mode = "state"

    def __init__(self, *replies: str) -> None:
        self._replies = iter(replies)

    def reset(self, task: Task, obs: Any, info: Any) -> None:
        pass

    def act(self, obs: Any, info: Any) -> Decision:
        return Decision(next(self._replies))


def recorded(env: EmbodiedEnv, task: Task, *replies: str) -> EpisodeRecord:
    record = play_episode(env, Says(*replies), task, 0)
    assert not record.error
    return record


def did(record: EpisodeRecord) -> list[str]:
    """Verbs and types of a record's steps, failed ones with a "!"."""
    return [
        f"{'' if step.success else '!'}{step.verb} {step.object_type}".rstrip()
        for step in record.steps
    ]


# -- what is a step --------------------------------------------------------------------------------


def test_what_names_no_object_or_makes_no_sense_costs_a_step(play: Play) -> None:
    infos = play(TAKE_APPLE, "open Bread", "navigate to Narnia", "pickup", "dance")
    assert [info["steps"] for info in infos] == [1, 2, 3, 4, 4]
    assert [info["action"] for info in infos[1:]] == [
        "open Bread",
        f"navigate to {NO_OBJECT}",
        f"pickup {NO_OBJECT}",
        "",
    ]
    assert not any(info["action_success"] for info in infos[1:])


def test_end_costs_no_step(play: Play) -> None:
    infos = play(TAKE_APPLE, "observe", "end")
    assert [info["steps"] for info in infos] == [1, 2, 2]
    assert not infos[-1]["end_appended"]


def test_three_replies_without_an_action_are_recorded_and_end_well(env: EmbodiedEnv) -> None:
    record = recorded(env, TAKE_APPLE, "navigate to CounterTop", "pickup Apple", "hm", "hm", "")
    assert did(record)[3:] == ["!error", "!error", "!error", "end"]
    assert record.steps[-1].appended
    assert record.steps[-1].interactable == record.steps[-2].interactable
    assert record.end_reason == "no known action"
    assert record.success
    paper, corrected = (score_episode(record, scorer) for scorer in (PAPER, CORRECTED))
    assert (paper.success, corrected.success) == (True, True)
    assert paper.search_efficiency == 4 / 7
    assert record.total_reward == 3


def test_the_step_limit_ends_well(env: EmbodiedEnv) -> None:
    looks = ["observe", "observe", "observe", "move forward"] * 6
    steps = ["navigate to CounterTop", "pickup Apple", *looks]
    record = recorded(env, TAKE_APPLE, *steps[:23])
    assert len(record.steps) == 25  # init, 23 more to the limit of 24, and the end
    assert did(record)[-1] == "end"
    assert record.end_reason == "step limit"
    assert record.success
    assert score_episode(record, PAPER).success


def test_a_cut_off_episode_that_did_nothing_is_no_success(env: EmbodiedEnv) -> None:
    record = recorded(env, TAKE_APPLE, "hm", "hm", "hm")
    assert did(record) == ["init", "!error", "!error", "!error", "end"]
    assert not record.success
    assert score_episode(record, PAPER).completeness == 1 / 2  # the appended end


def test_the_fourth_same_action_is_recorded_as_an_end_that_failed(env: EmbodiedEnv) -> None:
    record = recorded(env, TAKE_APPLE, *["navigate to Sink"] * 4)
    assert did(record)[1:3] == ["navigate to Sink"] * 2
    assert did(record)[4] == "!end"
    assert record.end_reason == "repeated action"
    assert len(record.steps) == 5


def test_an_unknown_reply_comes_between_same_actions(play: Play) -> None:
    infos = play(TAKE_APPLE, "observe", "observe", "observe", "hm", "observe")
    assert not infos[-1]["ended"]
    assert play(TAKE_APPLE, *["observe"] * 4)[-1]["ended"]


# -- what is understood ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "meant"),
    [
        ("navigate to Fridge", "navigate to Fridge"),
        ("navigate to the fridge", "navigate to Fridge"),
        ("navigate to Bed", f"navigate to {NO_OBJECT}"),
        ("put CounterTop", "put in CounterTop"),
        ("put in CounterTop", "put in CounterTop"),
        ("I put in CounterTop", "put in CounterTop"),
        ("putting it on CounterTop", "put in CounterTop"),
        ("toggle the StoveKnob", "toggle StoveKnob"),
        ("observe the Fridge", "observe"),
        ("move forward a bit", "move forward"),
        ("ending it here", "end"),
        ("init", "init"),
        ("Navigate to Fridge", None),
        (" navigate to Fridge", None),
        ("go to Fridge", None),
        ("pick up Apple", None),
        ("slice Bread", None),
        ("error", None),
        ("", None),
        (f"{NO_ACTION}and still put in CounterTop", None),
    ],
)
def test_texts_are_read_as_the_papers_runner_reads_them(
    env: EmbodiedEnv, text: str, meant: str | None
) -> None:
    env.reset(options={"task": TAKE_APPLE})
    action, said = parse_action_as_paper(text, env._episode.perception.objects)
    assert said == text
    assert (None if action is None else str(action)) == meant


def test_indices_and_actions_are_read_by_their_text(env: EmbodiedEnv) -> None:
    env.reset(options={"task": TAKE_APPLE})
    action = Action("navigate to", "Fridge")
    assert env.step(INDEX[action])[4]["action"] == env.step(action)[4]["action"] == str(action)
    with pytest.raises(gymnasium.error.InvalidAction):
        env.step(len(ACTIONS))


def test_init_begins_where_the_episode_began(env: EmbodiedEnv, play: Play) -> None:
    play(TAKE_APPLE)
    start = env.agent_pose
    assert play(TAKE_APPLE, "navigate to Fridge")[-1]["action_success"]
    assert env.agent_pose != start
    info = env.step("init")[4]
    assert info["action_success"]
    assert info["steps"] == 3
    assert replace(env.agent_pose, standing=True) == start


# -- what is legal ---------------------------------------------------------------------------------


def test_the_mask_allows_what_would_be_tried(env: EmbodiedEnv, play: Play) -> None:
    play(TAKE_APPLE, "navigate to CounterTop", "pickup Apple")
    available, known = env._episode._available, env._episode._known
    assert env.action_masks().tolist() == [
        int(
            action.verb != "slice"
            and not env._episode._handler.illegal_reason(action, available, known)
        )
        for action in ACTIONS
    ]


def test_state_and_hand_are_the_engines_affair(play: Play) -> None:
    infos = play(TAKE_APPLE, "navigate to CounterTop", "pickup Apple", "pickup Bread")
    assert infos[-2]["action_success"]
    assert infos[-1]["action_mask"][INDEX[Action("pickup", "Bread")]]
    assert not infos[-1]["action_success"]
    assert infos[-1]["object_id"] == BREAD  # it was tried


def test_what_is_held_is_at_hand(play: Play) -> None:
    infos = play(TAKE_APPLE, "navigate to CounterTop", "pickup Apple", "navigate to Window")
    assert "Apple" in infos[-1]["interactable"]


def test_things_of_the_types_that_lay_in_the_receptacle_are_within_reach_when_seen(
    env: EmbodiedEnv, play: Play
) -> None:
    """Their types are those of when the agent went there, in this case before it took the Apple."""
    task = replace(TAKE_APPLE, target_objects=(APPLE,), navigable_objects=("CounterTop",))
    play(task, "navigate to CounterTop", "pickup Apple")
    inside = env._episode._handler._inside  # type: ignore[attr-defined]
    play(task, "navigate to CounterTop", "pickup Apple", "navigate to Window")
    assert (env._episode._handler._inside == inside).all()  # type: ignore[attr-defined]  # no receptacle
    assert inside.any()


# -- which object, and from where ------------------------------------------------------------------


def test_a_type_stands_for_the_target_or_the_first_in_the_scene(
    env: EmbodiedEnv, play: Play
) -> None:
    aimed = replace(TAKE_APPLE, target_objects=(CABINET,), navigable_objects=("Cabinet",))
    assert play(aimed, "navigate to Cabinet")[-1]["object_id"] == CABINET
    free = replace(aimed, target_objects=())
    found = play(free, "navigate to Cabinet")[-1]["object_id"]
    first = next(o["objectId"] for o in env.objects if o["objectType"] == "Cabinet")
    assert found == first != CABINET


@pytest.mark.parametrize(("identity", "chosen"), [(84, 1), (1, 0)])
def test_two_of_the_papers_tasks_have_a_second_target(
    play: Play, identity: int, chosen: int
) -> None:
    targets = (CABINET, "Cabinet|-01.18|+00.50|-02.20")
    task = replace(
        TAKE_APPLE,
        target_objects=targets,
        navigable_objects=("Cabinet", "CounterTop"),
        extra={"identity": identity},
    )
    hold = ("navigate to CounterTop", "pickup Apple", "navigate to Cabinet")
    infos = play(task, "navigate to Cabinet", *hold)
    assert infos[1]["object_id"] == targets[0]
    assert infos[-1]["object_id"] == targets[chosen]


def test_a_switch_that_is_no_target_can_only_be_switched_once(play: Play) -> None:
    task = make_task("single_toggle", navigable_objects=("LightSwitch",))
    infos = play(task, *["navigate to LightSwitch", "toggle LightSwitch", "toggle LightSwitch"])
    results = [info["action_success"] for info in infos[2:]]
    switch = infos[-1]["object_id"]
    aimed = replace(task, target_objects=(switch,))
    infos = play(aimed, *["navigate to LightSwitch", "toggle LightSwitch", "toggle LightSwitch"])
    assert results == [True, False]
    assert [info["action_success"] for info in infos[2:]] == [True, True]


def test_a_stated_pose_holds_in_every_task(env: EmbodiedEnv, play: Play) -> None:
    pose = AgentPose(0.25, 0.9, -1.5, 180.0, 30.0)
    owner = replace(TAKE_APPLE, id="owner", poses={FRIDGE: pose})
    other, _ = with_every_pose([TAKE_APPLE, owner])
    play(other, "navigate to Fridge")
    agent = env.agent_pose
    assert (agent.x, agent.z, agent.rotation, agent.horizon) == (0.25, -1.5, 180.0, 30.0)


def test_of_several_poses_the_last_one_in_the_pose_file_counts() -> None:
    one, two = AgentPose(0, 0, 0, 0), AgentPose(1, 0, 0, 0)
    owner = replace(TAKE_APPLE, poses={FRIDGE: one})
    (task,) = with_every_pose([owner], {"7": {FRIDGE: one}, "8": {FRIDGE: two}})
    assert task.poses == {FRIDGE: two}


def test_going_to_what_holds_an_object_of_the_task_leads_to_the_object(
    env: EmbodiedEnv, play: Play
) -> None:
    def goes_to(kind: str, target: str, *related: str) -> AgentPose:
        task = replace(TAKE_APPLE, target_objects=(target,), related_objects=related)
        play(replace(task, navigable_objects=(kind,)), f"navigate to {kind}")
        return env.agent_pose

    at_the_apple = goes_to("Apple", APPLE, APPLE)
    assert goes_to("CounterTop", ISLAND, APPLE) == at_the_apple
    assert goes_to("CounterTop", ISLAND) != at_the_apple  # the island is three metres long


@pytest.mark.parametrize("kind", ["Fridge", "CounterTop", "Sink", "Toaster", "Drawer", "Window"])
def test_going_somewhere_leads_to_within_a_metre_and_a_half(
    env: EmbodiedEnv, play: Play, kind: str
) -> None:
    info = play(make_task("single_pickup", navigable_objects=(kind,)), f"navigate to {kind}")[-1]
    assert info["action_success"]
    (entry,) = (o for o in env.objects if o["objectId"] == info["object_id"])
    away = hypot(
        env.agent_pose.x - entry["position"]["x"], env.agent_pose.z - entry["position"]["z"]
    )
    assert away <= 1.5
    assert env.agent_pose.rotation % 45 == 0
    assert -30 <= env.agent_pose.horizon <= 60


def test_where_there_is_no_way_nothing_changes(env: EmbodiedEnv, play: Play) -> None:
    task = make_task(
        "single_pickup", navigable_objects=("Egg", "Pan"), target_objects=("Pan|0|0|0",)
    )
    start = play(task)[0]
    for reply in ("navigate to Egg", "navigate to Pan"):  # shut in the fridge; not in the scene
        pose = env.agent_pose
        info = env.step(reply)[4]
        assert not info["action_success"]
        assert env.agent_pose == pose
        assert env.details["interactable"] == start["interactable"]


# -- moving and looking ----------------------------------------------------------------------------


def walked(env: EmbodiedEnv, play: Play, task: Task, pose: AgentPose) -> tuple[bool, float, float]:
    """Whether a "move forward" from a pose is done, and how far it leads, right and ahead."""
    task = replace(task, poses={FRIDGE: pose}, navigable_objects=("Fridge",))
    play(task, "navigate to Fridge")
    before = env.agent_pose
    assert (before.x, before.z) == (pose.x, pose.z)
    done = env.step("move forward")[4]["action_success"]
    dx, dz = env.agent_pose.x - before.x, env.agent_pose.z - before.z
    assert env.agent_pose.rotation == before.rotation
    quarter = {0: (dx, dz), 90: (-dz, dx), 180: (-dx, -dz), 270: (dz, -dx)}
    right, ahead = quarter[int(before.rotation)]
    return done, round(right, 3), round(ahead, 3)


def places(env: EmbodiedEnv) -> Sequence[Any]:
    event = env._controller.step(action="GetReachablePositions")
    return event.metadata["actionReturn"]


def test_a_blocked_walk_is_a_step_to_the_side(env: EmbodiedEnv, play: Play) -> None:
    """At every tenth place in the kitchen, in every direction: ahead, or to the right, or nowhere
    and yet done, as the paper's program has it."""
    free = make_task("single_pickup")
    play(free)
    seen = {
        walked(env, play, free, AgentPose(p["x"], p["y"], p["z"], rotation))
        for p in places(env)[::60]
        for rotation in (0.0, 90.0, 180.0, 270.0)
    }
    assert {(True, 0.0, 0.5), (True, 0.5, 0.0)} <= seen
    assert seen <= {(True, 0.0, 0.5), (True, 0.5, 0.0), (True, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("blocked", "moves"),
    [
        ((), ["MoveBack"]),
        (("MoveBack",), ["MoveBack", "RotateRight 90", "MoveAhead"]),
        (
            ("MoveBack", "MoveAhead"),
            ["MoveBack", "RotateRight 90", "MoveAhead", "RotateLeft 180", "MoveAhead"],
        ),
        (
            ("MoveBack", "RotateRight", "MoveAhead"),
            ["MoveBack", "RotateRight 90", "MoveAhead", "MoveAhead"],
        ),
    ],
)
def test_who_is_shut_in_on_three_sides_backs_off(
    blocked: tuple[str, ...], moves: list[str]
) -> None:
    """No place in the recorded rooms is so narrow."""
    tried = []

    def step(action: str, renderImage: bool, degrees: int | str = "", **_: Any) -> Any:
        tried.append(f"{action} {degrees}".rstrip())
        error = "blocked" if action in blocked else ""
        return SimpleNamespace(metadata={"errorMessage": error})

    _back_off(SimpleNamespace(step=step))
    assert tried == moves


def test_a_step_to_the_side_goes_towards_what_the_task_is_about(
    env: EmbodiedEnv, play: Play
) -> None:
    play(make_task("single_pickup"))
    sides = set()
    for place in places(env)[::40]:
        for rotation in (0.0, 90.0, 180.0, 270.0):
            pose = AgentPose(place["x"], place["y"], place["z"], rotation)
            about = make_task("single_pickup", related_objects=(FRIDGE, ISLAND))
            done, right, ahead = walked(env, play, about, pose)
            assert done
            sides.add((right, ahead))
    assert {(0.5, 0.0), (-0.5, 0.0)} <= sides  # both sides are taken


def test_a_look_round_shows_what_it_says(env: EmbodiedEnv, play: Play) -> None:
    info = play(TAKE_APPLE, "observe")[-1]
    assert list(info["views"]) == list(skills.VIEWS)
    ahead = env.agent_pose.rotation
    views = observe(env._controller).views
    turns = {name: (view.pose.rotation - ahead) % 360 for name, view in views.items()}
    assert turns == {"right": 90, "behind": 180, "left": 270}
    assert env._controller.last_event.metadata["agent"]["rotation"]["y"] == ahead


# -- the option ------------------------------------------------------------------------------------


def test_an_unknown_protocol_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match=r"unknown protocol 'papers'.*default, paper"):
        EmbodiedEnv([], protocol="papers")


def test_the_papers_protocol_chooses_instances_itself() -> None:
    with pytest.raises(ValueError, match="leave out instances='explore'"):
        EmbodiedEnv([], protocol="paper", instances="explore")


def test_every_protocol_can_be_made_by_gymnasium() -> None:
    for name in PROTOCOLS:
        env = gymnasium.make("ER-SinglePickup-v0", protocol=name, obs_mode="state")
        env.reset(seed=1)
        for action in ("observe", INDEX[Action("open", "Fridge")], "move forward", "end"):
            *_, ended, _, info = env.step(action)
        assert (ended, info["end_reason"]) == (True, "end")
        env.close()
