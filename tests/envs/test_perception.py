"""Perception, judging and memory agree with the metadata, for any source of the columns."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from math import hypot
from typing import Any

import numpy as np
import pytest
from perceived import Entry, make_entry, perception_of, undrawn
from support import in_one_test

from er_gym.envs import skills
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.legality import KnownTypes, available_objects, legal_actions, navigable_within
from er_gym.envs.memory import Memory
from er_gym.envs.object_view import object_features
from er_gym.envs.perception import Perception, perceive, type_names
from er_gym.envs.perception import perception_of as perception_of_seen
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import AgentPose
from er_gym.thor.calls import Seen
from er_gym.thor.objects import KIND_OF, TYPES

START = AgentPose(0.0, 0.9, 0.0, 0.0)
FAR = (60.0, 0.0, 0.0)


def box(x: float, y: float, z: float, distance: float, **fields: Any) -> Entry:
    return make_entry("Apple|1", size=(x, y, z), centre=(distance, 5.0, 0.0), **fields)


@pytest.mark.parametrize(
    ("entry", "expected"),
    [
        (box(0.01, 0.01, 0.01, 0.99), True),
        (box(0.01, 0.01, 0.01, 1.0), False),
        (box(0.8, 0.8, 0.0, 9.9), True),  # S = 0.64 > 0.5, d < 10
        (box(0.8, 0.8, 0.0, 10.1), False),
        (box(0.4, 0.4, 0.0, 3.9), True),  # S = 0.16 > 0.15, d < 4
        (box(0.4, 0.4, 0.0, 4.1), False),
        (box(0.3, 0.3, 0.0, 2.4), True),  # S = 0.09 > 0.08, d < 2.5
        (box(0.3, 0.3, 0.0, 2.6), False),
        (box(0.2, 0.2, 0.2, 1.9), True),  # V = 0.008 > 0.005, d < 2
        (box(0.2, 0.2, 0.2, 2.1), False),
        (box(0.11, 0.11, 0.11, 1.4), True),  # V = 0.0013 > 0.001, d < 1.5
        (box(0.11, 0.11, 0.11, 1.6), False),
        (box(0.27, 0.27, 0.27, 0.9), True),
        (box(0.386, 0.386, 0.386, 2.8), True),  # V = 0.0575, V/d = 0.0205 > 0.02; S < 0.15
        (box(0.386, 0.386, 0.386, 2.9), False),  # V/d = 0.0198
        (box(2.0, 2.0, 2.0, 0.5, visible=False), False),
        (box(2.0, 2.0, 2.0, 0.5, objectType="Floor"), False),
        (box(0.1, 0.1, 0.1, 0.5, isPickedUp=True), False),
    ],
)
def test_navigable_rule(entry: Entry, expected: bool) -> None:
    available = available_objects(perception_of(entry))
    assert available.navigable.tolist() == available.interactable.tolist() == [0] * expected


def rule(volume: float, face: float, distance: float) -> bool:
    """The paper's, as it is written there."""
    return (
        distance < 1
        or (face > 0.5 and distance < 10)
        or (face > 0.15 and distance < 4)
        or (face > 0.08 and distance < 2.5)
        or (volume > 0.005 and distance < 2)
        or (volume > 0.001 and distance < 1.5)
        or (volume >= 0.01 and volume / distance > 0.02)
    )


def test_how_near_one_must_be_is_the_papers_rule() -> None:
    random = np.random.default_rng(0)
    volume, face = 10 ** random.uniform(-4, 0.5, (2, 20_000))
    face[:2000] = random.choice([0.08, 0.15, 0.5], 2000)  # the bounds themselves, too
    volume[2000:4000] = random.choice([0.001, 0.005, 0.01], 2000)
    distance = random.uniform(0.01, 12, 20_000)
    distance[4000:6000] = random.choice([1, 1.5, 2, 2.5, 4, 10], 2000)
    expected = list(map(rule, volume, face, distance))
    assert (distance < navigable_within(volume, face)).tolist() == expected


def test_what_is_like_the_contents_of_where_one_is_can_be_handled_wherever_it_is_seen() -> None:
    perception = perception_of(
        make_entry("Bowl|1", centre=FAR, receptacle=True, receptacleObjectIds=["Egg|1"]),
        make_entry("Egg|1", centre=FAR, visible=False, parentReceptacles=["Bowl|1"]),
        make_entry("Egg|2", centre=FAR),
        make_entry("Egg|3", centre=FAR, isPickedUp=True),
        make_entry("Apple|1", centre=FAR),
        make_entry("Egg|4"),
    )
    available = available_objects(perception, "Bowl|1")
    assert [perception.objects.ids[k] for k in available.navigable] == ["Egg|4"]
    assert [perception.objects.ids[k] for k in available.interactable] == ["Egg|2", "Egg|4"]
    for elsewhere in ("", "Egg|4", "Bowl|2"):
        found = available_objects(perception, elsewhere).interactable
        assert [perception.objects.ids[k] for k in found] == ["Egg|4"]


def told(mask: np.ndarray) -> list[str]:
    return [str(ACTIONS[k]) for k in np.flatnonzero(mask)]


def test_the_hand_decides_between_picking_up_and_putting() -> None:
    near = (make_entry("Apple|1", pickupable=True), make_entry("Bowl|1", receptacle=True))
    held = make_entry("Egg|1", pickupable=True, isPickedUp=True)
    for entries, legal in ((near, "pickup Apple"), ((*near, held), "put in Bowl")):
        mask = legal_actions(
            available_objects(perception_of(*entries)), KnownTypes(["Narnia", "Floor"])
        )
        assert set(told(mask)) == {"observe", "move forward", "end", legal}


def test_known_types_grow_and_are_told_in_order() -> None:
    known = KnownTypes(["Mug", "Narnia", "Floor"])
    assert known.names == ("Mug", "Narnia")
    known.add(np.array([KIND_OF["Apple"], KIND_OF["Mug"], KIND_OF["Apple"]]))
    assert known.names == ("Apple", "Mug", "Narnia")
    assert told(known.legal)[3:] == ["navigate to Apple", "navigate to Mug"]
    assert "Narnia" in known
    assert "Floor" not in known


def test_memory_is_of_what_was_seen_last() -> None:
    memory = Memory(START)
    shut, opened = make_entry("Cabinet|1"), make_entry("Cabinet|2", isOpen=True, isToggled=True)
    unseen = {**opened, "visible": False}
    for entries, remembered in (
        ((shut, unseen), False),
        ((opened, shut), True),  # any that is open
        ((unseen, make_entry("Apple|1")), True),
        ((shut, unseen), False),
    ):
        memory.look(perception_of(*entries))
        assert type_names(memory.is_open) == type_names(memory.is_on) == ("Cabinet",) * remembered
    assert type_names(memory.seen) == ("Apple", "Cabinet")


@in_one_test(
    "row",
    [  # what the mug lies in or on, innermost first; which of it is not seen; what the view says
        ((), (), ""),
        (("Shelf|1", "Cabinet|1"), (), "Shelf"),
        (("Shelf|1", "Cabinet|1"), ("Shelf|1",), "Cabinet"),
        (("Shelf|1", "Cabinet|1"), ("Cabinet|1",), "Shelf"),
        (("Shelf|1", "Cabinet|1"), ("Shelf|1", "Cabinet|1"), ""),
        (("Shelf|1",), ("Shelf|1",), ""),
        (("Floor|1",), (), ""),
        (("Floor|1", "Shelf|1"), (), "Shelf"),
    ],
)
def test_a_view_tells_the_innermost_holder_that_is_seen(
    row: tuple[tuple[str, ...], tuple[str, ...], str],
) -> None:
    holders, unseen, expected = row
    perception = perception_of(
        make_entry("Mug|1", parentReceptacles=list(holders)),
        *(make_entry(each, visible=each not in unseen, receptacle=True) for each in holders),
    )
    (mug,) = (each for each in perception.object_views if each.object_type == "Mug")
    assert mug.on == expected


@in_one_test(
    "row",
    [  # metres to the east and to the north; degrees to the right; metres; the side
        ((0.0, 2.0), 0.0, 2.0, "ahead"),
        ((2.0, 0.0), 90.0, 2.0, "right"),
        ((-3.0, 0.0), -90.0, 3.0, "left"),
        ((3.0, 4.0), 36.87, 5.0, "right"),
        ((0.4, 2.0), 11.31, 2.0396, "ahead"),
        ((-0.4, 2.0), -11.31, 2.0396, "ahead"),
        ((-0.5, 2.0), -14.036, 2.0616, "left"),
    ],
)
def test_a_view_tells_where_an_object_is(
    row: tuple[tuple[float, float], float, float, str],
) -> None:
    (x, z), bearing, distance, side = row
    (view,) = perception_of(make_entry("Mug|1", centre=(x, 5.0, z))).object_views
    assert (view.bearing, view.distance, view.side) == (bearing, distance, side)


def test_the_hand_holds_any_object_the_first_of_the_scene_too() -> None:
    held = make_entry("Egg|1", isPickedUp=True)
    mug = make_entry("Mug|1")
    assert perception_of(held, mug).held_name == perception_of(mug, held).held_name == "Egg"
    assert perception_of(mug).held_name == ""


def test_views_are_of_what_is_seen_and_not_held_the_nearest_first() -> None:
    perception = perception_of(
        make_entry("Mug|1", centre=(3.0, 0.0, 0.0)),
        make_entry("Mug|2", centre=(1.0, 0.0, 0.0), visible=False),
        make_entry("Egg|1", centre=(1.0, 0.0, 0.0), isPickedUp=True),
        make_entry("Floor|1"),
        make_entry("Fridge|1", centre=(2.0, 0.0, 0.0), openable=True, toggleable=True, isOpen=True),
    )
    views = perception.object_views
    assert [view.object_id for view in views] == ["Fridge|1", "Mug|1"]
    assert [(view.is_open, view.is_toggled) for view in views] == [(True, False), (None, None)]


def test_features_count_the_objects_of_a_type_up_to_ten() -> None:
    for count in (1, 3, 12):
        perception = perception_of(*(make_entry(f"Mug|{n}") for n in range(count)))
        features = object_features(perception.object_views)
        assert features[KIND_OF["Mug"], 0] == pytest.approx(min(count / 10, 1))
        assert features[:, 0].sum() == features[KIND_OF["Mug"], 0]


# -- random play -----------------------------------------------------------------------------------


def navigable_ids(metadata: dict[str, Any]) -> list[str]:
    """By the paper's rule, object by object."""
    agent = metadata["agent"]["position"]
    found = []
    for entry in metadata["objects"]:
        centre, size = (entry["axisAlignedBoundingBox"][key] for key in ("center", "size"))
        x, y, z = (size[axis] for axis in "xyz")
        distance = hypot(centre["x"] - agent["x"], centre["z"] - agent["z"])
        if (
            entry["visible"]
            and not entry["isPickedUp"]
            and entry["objectType"] != "Floor"
            and rule(x * y * z, max(x * y, y * z, x * z), distance)
        ):
            found.append(entry["objectId"])
    return found


@dataclasses.dataclass
class Twin:
    """Perceives as the environment does, and again from plain dictionaries; both must agree."""

    memories: tuple[Memory, Memory] = dataclasses.field(
        default_factory=lambda: (Memory(START), Memory(START))
    )
    held: int = 0
    events: int = 0

    def perceive(self, event: Any) -> Perception:
        metadata = dict(event.metadata)
        ours, plain = (
            perceive(event),
            perceive(undrawn(metadata)),
        )
        assert ours.pose == plain.pose
        assert np.allclose(ours.objects.centre, plain.objects.centre)  # what is carried moves
        assert (ours.visible_types == plain.visible_types).all()
        known = KnownTypes([])
        for at in ("", *ours.objects.ids):
            one, other = available_objects(ours, at), available_objects(plain, at)
            assert [ours.objects.ids[k] for k in one.navigable] == navigable_ids(metadata)
            assert one.interactable.tolist() == other.interactable.tolist()
            assert one.in_reach == other.in_reach
            assert told(legal_actions(one, known)) == told(legal_actions(other, known))
        for memory, perception in zip(self.memories, (ours, plain), strict=True):
            memory.look(perception)
        for field in ("seen", "is_open", "is_on"):
            one_mark, other_mark = (getattr(memory, field) for memory in self.memories)
            assert (one_mark == other_mark).all()
        self.held += ours.objects.held >= 0
        self.events += 1
        return ours


def random_play(env: EmbodiedEnv, steps: int) -> Iterator[dict[str, Any]]:
    random = np.random.default_rng(0)
    over = True
    for _ in range(steps):
        if over:
            _, info = env.reset(seed=int(random.integers(1000)))
        legal = np.flatnonzero(info["action_mask"])
        # Navigation outnumbers the rest by far: take a verb first.
        verb = random.choice(sorted({ACTIONS[k].verb for k in legal} - {"end"}))
        action = random.choice([k for k in legal if ACTIONS[k].verb == verb])
        *_, terminated, truncated, info = env.step(int(action))
        over = terminated or truncated
        yield info


SCENES = ("FloorPlan1", "FloorPlan212", "FloorPlan302", "FloorPlan410")


@pytest.mark.parametrize("scene", SCENES)
def test_columns_and_entries_are_perceived_alike(
    scene: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = dataclasses.replace(load_suite("mini").tasks[0], scene=scene)
    env, twin = EmbodiedEnv([task], obs_mode="state", instances="explore"), Twin()

    def by_event(seen: Seen) -> Perception:
        """What was told without an event is what one tells."""
        ours, direct = twin.perceive(env._controller.last_event), perception_of_seen(seen)
        assert (direct.visible == ours.visible).all()
        assert (direct.interactable == ours.interactable).all()
        assert direct.pose == ours.pose
        assert direct.objects.ids == ours.objects.ids
        return ours

    monkeypatch.setattr(skills, "perception_of", by_event)
    infos = list(random_play(env, 60))
    assert {info["verb"] for info in infos} >= {"pickup", "put in", "observe"}
    assert twin.events > 60
    assert twin.held > 5
    env.close()


def test_no_event_is_kept_while_the_controller_acts(monkeypatch: pytest.MonkeyPatch) -> None:
    """Else the engine would have to work out all that it says before the world changes."""
    settled: list[LazyMetadata] = []
    monkeypatch.setattr(LazyMetadata, "settle", lambda self: settled.append(self))
    env = EmbodiedEnv(obs_mode="state+text")
    reset = env.reset

    def reset_apart(**arguments: Any) -> Any:  # the official client's reset keeps its last event
        kept = len(settled)
        began = reset(**arguments)
        del settled[kept:]
        return began

    monkeypatch.setattr(env, "reset", reset_apart)
    infos = list(random_play(env, 60))
    assert {info["verb"] for info in infos} >= {"observe", "move forward", "navigate to"}
    assert not settled
    env.close()


def test_types_are_in_alphabetical_order() -> None:
    """Names are read off arrays over types, and told in that order."""
    assert list(TYPES) == sorted(TYPES)
