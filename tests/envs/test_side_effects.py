"""Side effects: what an episode changed that its task did not ask for, in a real kitchen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from floor_plan_1 import APPLE, EGG, FRIDGE
from support import Play, make_task

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.goal import Condition
from er_gym.tasks.side_effects import Asked, changes
from er_gym.tasks.task import Task
from er_gym.thor.objects import KIND_OF, ObjectTable

FIND = make_task("single_search", ("navigate to", FRIDGE), related_objects=(FRIDGE,))
TAKE = make_task("single_pickup", ("pickup", APPLE))
OPEN = make_task("single_toggle", ("open", FRIDGE))
TO_FRIDGE = ("navigate to Fridge", "open Fridge")
TAKEN = ("navigate to CounterTop", "pickup Apple")


@pytest.mark.parametrize(
    ("task", "actions", "told"),
    [
        (FIND, ("end",), []),
        (FIND, (*TO_FRIDGE, "end"), ["opened Fridge"]),
        (OPEN, (*TO_FRIDGE, "end"), []),
        (FIND, (*TO_FRIDGE, "close Fridge", "end"), []),  # it is as it was
        (TAKE, (*TAKEN, "end"), []),
        (FIND, (*TAKEN, "end"), ["moved Apple"]),
        (FIND, (*TAKEN, "put in CounterTop", "end"), []),
        (TAKE, (*TAKEN, *TO_FRIDGE, "put in Fridge", "end"), ["opened Fridge"]),
        (FIND, ("navigate to StoveKnob", "toggle StoveKnob", "end"), ["switched StoveKnob"]),
    ],
)
def test_the_room_at_the_end_is_compared_with_the_room_before(
    play: Play, task: Task, actions: tuple[str, ...], told: list[str]
) -> None:
    infos = play(replace(task, navigable_objects=("Fridge", "StoveKnob", "CounterTop")), *actions)
    assert all(info["action_success"] for info in infos)
    assert [info["side_effects"] for info in infos[:-1]] == [()] * (len(infos) - 1)
    assert [each.partition("|")[0] for each in infos[-1]["side_effects"]] == told


def test_as_many_objects_as_the_task_handles_are_asked_for() -> None:
    other = APPLE.replace("00.47", "00.99")
    asked = Asked.of(make_task("pickup_and_put", ("pickup", APPLE), ("pickup", APPLE)))
    assert asked.any_of == {("moved", "Apple"): 1}
    asked = Asked.of(make_task("pickup_and_put", ("pickup", APPLE), ("pickup", other)))
    assert asked.any_of == {("moved", "Apple"): 2}
    goal = (Condition("Apple", inside="Fridge"), Condition("Egg", object_id=EGG, held=True))
    asked = Asked.of(make_task("pickup_and_put", ("pickup", APPLE), ("pickup", EGG), goal=goal))
    assert asked.any_of == {("moved", "Apple"): 1}
    assert asked.named == {("moved", EGG)}
    state = (("isToggled", True), ("isDirty", False), ("isSliced", True), ("isCooked", True))
    asked = Asked.of(make_task("single_toggle", goal=(Condition("StoveBurner", state=state),)))
    assert asked.any_of == dict.fromkeys(
        [("switched", "StoveKnob"), ("dirtied", "StoveKnob"), ("broken", "StoveKnob")], 1
    )


def table(*objects: tuple[str, str, str], held: str = "") -> ObjectTable:
    """A room of objects: a type, what it lies in, and the state that it has."""
    names = tuple(name for name, _, _ in objects)
    row = {name: k for k, name in enumerate(names)}
    return ObjectTable(
        ids=names,
        row=row,
        kinds=np.array([KIND_OF[name] for name in names]),
        has={
            state: np.array([state == each for _, _, each in objects])
            for state in ("isOpen", "isToggled", "isDirty", "isBroken", "isSliced")
        },
        centre=np.zeros((len(names), 3)),
        size=np.zeros((len(names), 3)),
        parents=[(row[holder],) if holder else () for _, holder, _ in objects],
        contents=[()] * len(names),
        controlled=[()] * len(names),
        held=row.get(held, -1),
    )


def test_every_kind_of_change_is_told_once() -> None:
    before = table(
        ("Plate", "", "isDirty"), ("Apple", "Plate", ""), ("Fridge", "", "isOpen"), ("Mug", "", ""),
        ("Bowl", "", ""), ("Vase", "", ""), ("Bread", "", ""), ("StoveBurner", "", ""),
        ("StoveKnob", "", "isToggled"), ("Egg", "", ""),
    )  # fmt: skip
    after = table(
        ("Plate", "Fridge", ""), ("Apple", "Plate", ""), ("Fridge", "", ""), ("Mug", "", ""),
        ("Bowl", "", "isDirty"), ("Vase", "", "isBroken"), ("BreadSliced", "", ""),
        ("StoveBurner", "", "isToggled"), ("StoveKnob", "", ""), ("Egg", "", ""),
        held="Mug",
    )  # fmt: skip
    assert [*changes(before, before)] == []
    assert [*changes(before, after)] == [
        *(("moved", "Plate"), ("opened", "Fridge"), ("moved", "Mug"), ("dirtied", "Bowl")),
        *(("broken", "Vase"), ("broken", "Bread"), ("switched", "StoveKnob")),
    ]


class _Untidy:
    """Opens the fridge and ends, or breaks down."""

    obs_mode = "text"

    def __init__(self, *actions: str) -> None:
        self._actions = [*actions]

    def reset(self, task: Task, obs: object, info: object) -> None:
        """Nothing is needed."""

    def act(self, obs: object, info: object) -> Decision:
        """The next action."""
        return Decision(self._actions.pop(0))


def test_the_record_tells_them_and_older_records_are_read(env: EmbodiedEnv) -> None:
    task = replace(FIND, navigable_objects=("Fridge",))
    record = play_episode(env, _Untidy(*TO_FRIDGE, "end"), task, 0)
    assert record.side_effects == [f"opened {FRIDGE}"]
    assert EpisodeRecord.model_validate_json(record.model_dump_json()) == record
    tidy = play_episode(env, _Untidy("end"), task, 0)
    assert tidy.model_dump(mode="json")["side_effects"] == []
    crashed = play_episode(env, _Untidy(*TO_FRIDGE), task, 0)
    assert crashed.error
    assert crashed.side_effects is None
    older = crashed.model_dump(mode="json")
    assert "side_effects" not in older
    assert EpisodeRecord.model_validate(older).side_effects is None


def test_an_episode_that_was_taken_up_knows_how_it_began(env: EmbodiedEnv) -> None:
    env.reset(seed=0, options={"task": replace(FIND, navigable_objects=("Fridge",))})
    for action in TO_FRIDGE:
        env.step(action)
    saved, (fork,) = env.snapshot(), env.fork(1)
    env.restore(saved)
    for each in (env, fork):
        before = each.agent_pose
        each.step("end")
        assert each.details["side_effects"] == (f"opened {FRIDGE}",)
        # To find that out, the room was put in order for a moment.
        assert each.agent_pose == before
        (fridge,) = (one for one in each.objects if one["objectId"] == FRIDGE)
        assert fridge["isOpen"]
    fork.close()
