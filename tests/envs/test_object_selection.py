"""Which object a type name stands for."""

from __future__ import annotations

from dataclasses import replace

from perceived import make_entry, perception_of
from support import in_one_test, make_task

from er_gym.envs.object_selection import (
    closed_container_of,
    navigation_target,
    select_for_task,
    select_nearest,
)
from er_gym.tasks.task import AgentPose

MUGS = tuple(f"Mug|{number}" for number in range(6))
TASK = make_task(
    "single_pickup",
    ("navigate to", "Mug|1"),
    ("pickup", "Mug|2"),
    target_objects=("Mug|4",),
    related_objects=("Mug|5",),
)


@in_one_test(
    "row",
    [  # the key actions left; the verb; the mugs there are; the one that is meant
        (2, "navigate to", (0, 1, 2, 3, 4, 5), 1),
        (2, "pickup", (0, 1, 2, 3, 4, 5), 2),
        (2, "open", (0, 2, 1, 3, 4, 5), 1),  # of any key action, the first
        (1, "navigate to", (0, 1, 2, 3, 4, 5), 2),  # done is done
        (1, "pickup", (0, 1, 3, 4, 5), 3),  # what the pending one is about
        (0, "pickup", (0, 2, 4, 5), 2),  # of a key action that is done
        (0, "pickup", (0, 4, 5), 4),
        (0, "pickup", (0, 5), 5),
        (0, "pickup", (0,), 0),  # nothing to do with the task: the first in the scene
    ],
)
def test_what_the_task_is_about_comes_first(row: tuple[int, str, tuple[int, ...], int]) -> None:
    left, verb, there, meant = row
    keys = TASK.key_actions[:-1]
    keys = (keys[0], replace(keys[1], related_objects=("Mug|3",)))
    task = replace(TASK, key_actions=(*keys, TASK.key_actions[-1]))
    objects = perception_of(*(make_entry(each) for each in MUGS)).objects
    assert select_for_task(task, keys[2 - left :], verb, there, objects) == meant


def test_the_nearest_that_was_not_visited() -> None:
    agent = AgentPose(1.0, 0.9, 1.0, 0.0)
    centres = ((4.0, 0.0, 1.0), (1.0, 9.0, 2.5), (3.0, 0.0, 3.0))  # 3, 1.5 and 2.8 m away
    objects = perception_of(
        *(make_entry(each, centre=at) for each, at in zip(MUGS, centres, strict=False))
    ).objects
    order = []
    for _ in centres:
        order.append(select_nearest((0, 1, 2), objects, agent, [MUGS[k] for k in order]))
    assert order == [1, 2, 0]
    assert select_nearest((0, 1, 2), objects, agent, MUGS) == 1  # all visited: once more
    assert select_nearest((0, 2), objects, agent) == 2


@in_one_test(
    "row",
    [  # the holder: openable, a receptacle; what the agent goes to
        ((False, True), "Mug|1"),
        ((True, True), "Shelf|1"),
        ((False, False), "Shelf|1"),
    ],
)
def test_the_agent_goes_to_what_lies_on_a_receptacle(row: tuple[tuple[bool, bool], str]) -> None:
    (openable, receptacle), expected = row
    objects = perception_of(
        make_entry(
            "Shelf|1",
            openable=openable,
            receptacle=receptacle,
            receptacleObjectIds=["Mug|0", "Mug|1"],
        ),
        *(make_entry(each, parentReceptacles=["Shelf|1"]) for each in ("Mug|0", "Mug|1")),
        make_entry("Mug|2"),
    ).objects
    task = replace(TASK, related_objects=("Mug|7", "Mug|2", "Mug|1", "Mug|0"))
    assert objects.ids[navigation_target(task, 0, objects)] == expected
    unrelated = replace(TASK, related_objects=("Mug|2",))
    assert navigation_target(unrelated, 0, objects) == 0


@in_one_test(
    "row",
    [  # drawer and cabinet around the mug, innermost first: open or closed; what is to be opened
        (("open", "open"), None),
        (("closed", "open"), "Drawer|1"),
        (("open", "closed"), "Cabinet|1"),
        (("closed", "closed"), "Cabinet|1"),
        (("closed", "no door"), "Drawer|1"),
        (("no door", "no door"), None),
    ],
)
def test_the_outermost_closed_container(row: tuple[tuple[str, str], str | None]) -> None:
    states, expected = row
    names = ("Drawer|1", "Cabinet|1")
    objects = perception_of(
        make_entry("Mug|1", parentReceptacles=list(names)),
        *(
            make_entry(name, receptacle=True, openable=how != "no door", isOpen=how == "open")
            for name, how in zip(names, states, strict=True)
        ),
    ).objects
    found = closed_container_of(0, objects)
    assert (None if found is None else objects.ids[found]) == expected
