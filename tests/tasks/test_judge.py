"""The judge's rules, one by one."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from er_gym.tasks.equivalence import same_type
from er_gym.tasks.goal import Condition, unmet_conditions
from er_gym.tasks.judge import Criteria, Progress, replay, search_targets
from er_gym.tasks.task import KeyAction, Task
from er_gym.tasks.types import BY_NAME

EGG, OTHER_EGG = "Egg|+00.00|+01.00|+02.00", "Egg|+09.00|+01.00|+02.00"
MUG = "Mug|+00.00|+01.00|+03.00"
BOWL = "Bowl|+00.00|+01.00|+04.00"
SINK = "Sink|-01.99|+01.14|-00.98"
BASIN = f"{SINK}|SinkBasin"
TUB = "Bathtub|-01.99|+01.14|-00.98|BathtubBasin"
END = KeyAction("end")


@dataclass(frozen=True)
class Step:
    verb: str
    object_type: str = ""
    object_id: str = ""
    success: bool = True
    interactable: tuple[str, ...] = field(default=())


def judge(criteria: Criteria, *steps: Step, goal_holds: bool = True) -> Progress:
    return replay(criteria, steps, goal_holds=goal_holds)


def go(object_id: str) -> KeyAction:
    return KeyAction("navigate to", object_id)


def take(object_id: str) -> KeyAction:
    return KeyAction("pickup", object_id)


def put(object_id: str) -> KeyAction:
    return KeyAction("put in", object_id)


def step(key: KeyAction) -> Step:
    return Step(key.verb, key.actual_type, key.object_id)


ALL_DONE = Step("end")
TRANSFER = Criteria((go(EGG), take(EGG), go(BOWL), put(BOWL), END))


def test_all_key_actions_and_an_end_are_a_success() -> None:
    progress = judge(TRANSFER, Step("init"), *map(step, TRANSFER.key_actions))
    assert progress.success
    assert (progress.done, progress.left) == (TRANSFER.key_actions, ())


def test_navigations_are_not_needed_but_earn() -> None:
    bare = judge(TRANSFER, step(take(EGG)), step(put(BOWL)), ALL_DONE)
    assert bare.success
    assert bare.left == (go(EGG), go(BOWL))
    assert sum(key.reward for key in bare.done) == 3


@pytest.mark.parametrize(
    "steps",
    [
        (),
        (ALL_DONE,),
        (step(take(EGG)), step(put(BOWL))),  # it never says so, as at the step limit
        (step(take(EGG)), Step("put in", "Bowl", BOWL, success=False), ALL_DONE),
        (step(take(EGG)), step(put(BOWL)), Step("end", success=False)),  # a fourth repetition
        (step(take(EGG)), ALL_DONE, step(put(BOWL)), ALL_DONE),  # the first end decides
        (step(take(EGG)), step(take(EGG)), ALL_DONE),
    ],
)
def test_what_is_no_success(steps: tuple[Step, ...]) -> None:
    progress = judge(TRANSFER, *steps)
    assert not progress.success
    assert END in progress.left


def test_nothing_counts_after_a_success() -> None:
    won = judge(TRANSFER, step(take(EGG)), step(put(BOWL)), ALL_DONE)
    assert won.after("navigate to", "Egg", EGG) == (won, 0.0)
    assert won.after("end") == (won, 0.0)


def test_a_task_that_lists_no_end_asks_for_it_all_the_same() -> None:
    criteria = Criteria((take(EGG),))
    assert not judge(criteria, step(take(EGG))).success
    assert judge(criteria, step(take(EGG)), ALL_DONE).success
    assert judge(Criteria(()), ALL_DONE).success


def test_end_earns_its_reward_only_as_a_success() -> None:
    start = Progress.start(Criteria((take(EGG), KeyAction("end", reward=5.0))))
    assert start.after("end")[1] == 0
    one, reward = start.after("pickup", "Egg", EGG)
    assert (reward, one.after("end")[1], one.after("end", goal_holds=False)[1]) == (1, 5, 0)


def test_a_goal_that_does_not_hold_is_no_success() -> None:
    steps = (step(take(EGG)), step(put(BOWL)), ALL_DONE)
    assert not judge(TRANSFER, *steps, goal_holds=False).success


# -- types and instances ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (put(BASIN), "Sink"),
        (put(BASIN), "SinkBasin"),
        (put(SINK), "SinkBasin"),
        (put(TUB), "Bathtub"),
        (KeyAction("put in", TUB.removesuffix("|BathtubBasin"), "Bathtub"), "BathtubBasin"),
        (KeyAction("put in", BOWL, object_type="Egg"), "Bowl"),  # the id is right
        (KeyAction("put in", "", object_type="Bowl"), "Bowl"),
    ],
)
def test_types_that_are_one(key: KeyAction, said: str) -> None:
    assert judge(Criteria((key, END)), Step("put in", said), ALL_DONE).success


@pytest.mark.parametrize(
    ("key", "said"),
    [
        (put(BASIN), "BathtubBasin"),
        (put(TUB), "Sink"),
        (put(BOWL), "Plate"),
        (KeyAction("put in", BOWL, object_type="Egg"), "Egg"),
    ],
)
def test_types_that_are_not(key: KeyAction, said: str) -> None:
    assert not judge(Criteria((key, END)), Step("put in", said), ALL_DONE).success


def test_only_basins_have_a_second_name() -> None:
    names = ("Sink", "SinkBasin", "Bathtub", "BathtubBasin", "Mug", "Cup")
    same = {(a, b) for a in names for b in names if a != b and same_type(a, b)}
    assert same == {
        *(("Sink", "SinkBasin"), ("SinkBasin", "Sink")),
        *(("Bathtub", "BathtubBasin"), ("BathtubBasin", "Bathtub")),
    }


def test_any_object_of_the_type_will_do_unless_it_is_named() -> None:
    other = Step("pickup", "Egg", OTHER_EGG)
    assert judge(Criteria((take(EGG), END)), other, ALL_DONE).success
    named = Criteria((take(EGG), END), named=frozenset({EGG}))
    assert not judge(named, other, ALL_DONE).success
    assert judge(named, other, step(take(EGG)), ALL_DONE).success


def test_the_key_action_on_a_named_object_goes_first() -> None:
    criteria = Criteria((take(OTHER_EGG), take(EGG), END), named=frozenset({EGG}))
    both = (step(take(EGG)), Step("pickup", "Egg", "Egg|+05.00|+01.00|+02.00"))
    assert judge(criteria, *both, ALL_DONE).success


# -- order -----------------------------------------------------------------------------------------

TWO = (go(EGG), take(EGG), go(BOWL), put(BOWL), go(MUG), take(MUG), go(BASIN), put(BASIN), END)
SWAPPED = tuple(map(step, (*TWO[4:8], *TWO[:4], END)))


def test_swapped_transfers_are_a_success_only_where_order_does_not_matter() -> None:
    assert judge(Criteria(TWO), *SWAPPED).success
    ordered = judge(Criteria(TWO, ordered=True), *SWAPPED)
    assert not ordered.success
    assert [key.object_id for key in ordered.done] == [EGG, EGG, BOWL, BOWL]


def test_what_was_done_out_of_turn_can_be_done_again_in_its_turn() -> None:
    again = (*SWAPPED[:-1], *map(step, TWO[4:]))
    assert judge(Criteria(TWO, ordered=True), *again).success


def test_in_an_ordered_task_navigations_are_free() -> None:
    only_scored = [key for key in TWO if key.verb != "navigate to"]
    assert judge(Criteria(TWO, ordered=True), *map(step, only_scored)).success
    progress = Progress.start(Criteria(TWO, ordered=True))
    assert progress.after("navigate to", "Mug", MUG) == (progress, 0.0)  # not yet its turn
    assert progress.after("navigate to", "Egg", EGG)[1] == 1


# -- searches --------------------------------------------------------------------------------------

SEARCH = Criteria((go(BOWL), END), targets=frozenset({"Mug", "Sink"}))


@pytest.mark.parametrize(
    ("within_reach", "found"),
    [
        (("Bowl", "Mug", "Sink"), True),
        (("Mug", "SinkBasin"), True),
        (("Mug",), False),
        (("Sink", "SinkBasin"), False),
        ((), False),
    ],
)
def test_a_search_asks_for_all_its_targets_within_reach(
    within_reach: tuple[str, ...], found: bool
) -> None:
    end = Step("end", interactable=within_reach)
    assert judge(SEARCH, end).success is found
    assert judge(SEARCH, step(go(BOWL)), end).success is found


def a_task(kind: str, *keys: KeyAction, related: tuple[str, ...] = ()) -> Task:
    return Task("task", BY_NAME[kind], "FloorPlan1", "", keys, related_objects=related)


def test_search_targets() -> None:
    end = KeyAction("end", related_objects=(BOWL, MUG))
    assert search_targets(a_task("single_search", go(BOWL), end)) == {"Mug"}
    assert search_targets(a_task("single_search", end, related=(EGG,))) == {"Egg"}
    assert search_targets(a_task("single_search")) == frozenset()
    assert search_targets(a_task("single_pickup", end, related=(EGG,))) == frozenset()


def test_criteria_of_a_task() -> None:
    two = a_task("ordered_pickup_two_object_and_put", *TWO)
    assert Criteria.of(two) == Criteria(TWO, ordered=True)


# -- goals -----------------------------------------------------------------------------------------


def entry(object_id: str, object_type: str, *parents: str) -> dict[str, object]:
    return {
        "objectId": object_id,
        "objectType": object_type,
        "parentReceptacles": list(parents),
        "isPickedUp": False,
    }


def test_what_is_in_the_basin_is_in_the_sink_but_what_is_on_the_rim_is_not_in_the_basin() -> None:
    room = [entry(SINK, "Sink"), entry(BASIN, "SinkBasin")]
    for place, fulfils in ((BASIN, {"Sink", "SinkBasin"}), (SINK, {"Sink"}), ("gone", set())):
        objects = [*room, entry(EGG, "Egg", place)]
        for inside in ("Sink", "SinkBasin", "Bathtub", "Bowl"):
            assert (not unmet_conditions([Condition("Egg", inside=inside)], objects)) == (
                inside in fulfils
            )


def test_a_goal_to_have_a_sink_in_reach_is_met_by_its_basin() -> None:
    goal = [Condition("Sink", in_reach=True)]
    assert not unmet_conditions(goal, [entry(SINK, "Sink")], ["SinkBasin"])
    assert unmet_conditions(goal, [entry(SINK, "Sink")], ["BathtubBasin"])


def test_progress_is_known_by_the_numbers_of_what_is_done() -> None:
    criteria = Criteria((go(BOWL), take(EGG), put(BOWL), take(EGG), go(BOWL), END))
    steps = [go(BOWL), take(EGG), go(BOWL), take(EGG), put(BOWL), END]
    for count in range(len(steps) + 1):
        progress = judge(criteria, *map(step, steps[:count]))
        numbers = progress.numbers_done
        assert len({*numbers}) == count
        assert progress == Progress.at(criteria, numbers, progress.ended, progress.success)
    assert progress.success
