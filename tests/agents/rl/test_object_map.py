"""The object map: where objects are, by hand and in a room; a policy that begins to read it."""

from __future__ import annotations

from collections import Counter
from math import cos, exp, hypot, log1p, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from gymnasium import spaces
from pydantic import ValidationError
from untrained_policy import write_untrained_run

from agents.rl.anchored import starting_network
from agents.rl.config import EnvConfig, how_learnt
from agents.rl.envs import make_env
from agents.rl.object_map import MAP_FEATURES, MAP_LAYOUT, ObjectMap
from agents.rl.policy_file import MODEL, load_network, untrained_network
from agents.rl.subtasks import Progress
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.info import names
from er_gym.envs.object_view import ObjectView
from er_gym.envs.observations import SCALARS, STATE_LAYOUT
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES


def drawer(number: int, right: float, ahead: float, is_open: bool = False) -> ObjectView:
    """As the agent sees it from where it starts."""
    return thing("Drawer", number, right, ahead, is_open=is_open)


def thing(
    name: str, number: int, right: float, ahead: float, on: str = "", is_open: bool | None = None
) -> ObjectView:
    bearing = float(np.degrees(np.arctan2(right, ahead)))
    return ObjectView(f"{name}|{number}", name, bearing, hypot(right, ahead), on, is_open)


def state(right: float = 0.0, ahead: float = 0.0, turned: float = 0.0) -> np.ndarray:
    """The environment's observation of an agent there, metres and degrees clockwise."""
    made = np.zeros(len(STATE_LAYOUT), np.float32)
    pose = {"right": right / 10, "ahead": ahead / 10}
    pose |= {"sin": sin(radians(turned)), "cos": cos(radians(turned))}
    for name, value in pose.items():
        made[SCALARS.index(name)] = value
    return made


def step(
    *ahead: ObjectView,
    did: str = "",
    to: str = "",
    success: bool = True,
    around: dict[str, tuple[ObjectView, ...]] | None = None,
) -> dict[str, Any]:
    return {
        "verb": did,
        "object_id": to,
        "object_type": to.partition("|")[0],
        "action_success": success,
        "object_views": ahead,
        "object_views_around": around or {},
    }


def marked(vector: np.ndarray, feature: str) -> dict[str, float]:
    """The types with the feature."""
    row = vector.reshape(len(MAP_FEATURES), len(TYPES))[MAP_FEATURES.index(feature)]
    return {TYPES[kind]: float(row[kind]) for kind in row.nonzero()[0]}


def count(number: int) -> Any:
    return pytest.approx(log1p(number) / log1p(20))


def test_the_next_one_is_the_nearest_that_was_not_visited() -> None:
    memory = ObjectMap(Progress("Pick up the Mug."))
    near, far = drawer(1, 0.0, 1.0), drawer(2, 3.0, 4.0)
    seen = memory.update(state(), step(near, far))
    assert marked(seen, "unvisited")["Drawer"] == count(2)
    assert marked(seen, "next new")["Drawer"] == pytest.approx(1 - exp(-1.0))
    assert marked(seen, "next looks")["Drawer"] == count(1)
    # It goes to the near one, a metre ahead: the far one is next, now 3 right and 3 ahead.
    seen = memory.update(state(ahead=1.0), step(did=verbs.NAVIGATE, to="Drawer|1"))
    assert marked(seen, "unvisited")["Drawer"] == count(1)
    assert marked(seen, "next new")["Drawer"] == pytest.approx(1 - exp(-hypot(3, 3)))
    assert marked(seen, "next looks") == {}
    # Once it has been to both, all count as visited, and the nearest is next.
    seen = memory.update(state(3.0, 3.0), step(did=verbs.NAVIGATE, to="Drawer|2"))
    assert marked(seen, "unvisited") == {}
    assert marked(seen, "next new")["Drawer"] == pytest.approx(1 - exp(-1.0))
    # A new round begins with whichever it goes to.
    seen = memory.update(state(3.0, 3.0), step(did=verbs.NAVIGATE, to="Drawer|2"))
    assert marked(seen, "unvisited")["Drawer"] == count(1)
    there = marked(seen, "next new")["Drawer"]
    assert there == pytest.approx(0.0, abs=1e-6)  # it has stood where the first one is


@pytest.mark.parametrize(("name", "turned"), [("right", 90), ("behind", 180), ("left", 270)])
def test_positions_do_not_depend_on_where_it_looks(name: str, turned: float) -> None:
    """A table two metres to the right of the start, seen in turn from the start, from elsewhere and
    by a look around, is one table in one place."""
    places = []
    seen_there = ObjectView("Desk|1", "Desk", 0.0, 2.0)
    for at, info in (
        (state(), step(ObjectView("Desk|1", "Desk", 90.0, 2.0))),
        (state(2.0, 3.0, 180.0), step(ObjectView("Desk|1", "Desk", 0.0, 3.0))),
        (state(0.0, 0.0, 90.0 - turned), step(around={name: (seen_there,)})),
    ):
        progress = Progress("Put the Mug in the Sink, then pick up the Book.")
        memory = ObjectMap(progress)
        memory.update(at, info)
        progress.number = 2  # of which it has been nowhere else than three metres behind the table
        seen = memory.update(state(2.0, -3.0), step())
        assert marked(seen, "next new")["Desk"] == pytest.approx(1 - exp(-3.0), abs=1e-5)
        places.append(marked(seen, "unvisited"))
    assert places == [{"Desk": count(1)}] * 3


def test_what_is_behind_closed_doors() -> None:
    """Three drawers side by side, and one far away; the fridge holds no pen."""
    memory = ObjectMap(Progress("Pick up the Pen."))
    drawers = [drawer(number, number / 2, 2.0) for number in range(3)]
    fridge = thing("Fridge", 1, 0.2, 2.0, is_open=False)
    seen = memory.update(state(), step(*drawers, drawer(3, 0.0, -5.0), fridge))
    assert marked(seen, "unopened") == {"Drawer": count(4)}
    assert marked(seen, "next to unopened") == {"Drawer": count(1), "Fridge": count(3)}
    # The middle one is opened, and seen so; then closed again.
    middle = drawer(1, 0.5, 2.0, is_open=True)
    seen = memory.update(state(), step(middle, did=verbs.OPEN, to="Drawer|1"))
    assert marked(seen, "unopened") == {"Drawer": count(3)}
    assert marked(seen, "next to unopened") == {"Fridge": count(2)}
    seen = memory.update(state(), step(did=verbs.CLOSE, to="Drawer|1"))
    assert marked(seen, "unopened") == {"Drawer": count(3)}
    # One that did not open is closed still.
    seen = memory.update(state(), step(did=verbs.OPEN, to="Drawer|0", success=False))
    assert marked(seen, "unopened") == {"Drawer": count(3)}


def test_the_instruction_says_where() -> None:
    memory = ObjectMap(Progress("Pick up the Egg that is in the Microwave."))
    closed = [thing(name, 1, 1.0, 1.0, is_open=False) for name in ("Microwave", "Fridge")]
    seen = memory.update(state(), step(*closed, thing("Cup", 1, 1.0, 1.0, on="Microwave")))
    assert marked(seen, "unopened") == {"Microwave": count(1)}
    assert marked(seen, "next on fitting") == {"Cup": 1.0}


def test_one_drawer_covers_another() -> None:
    memory = ObjectMap(Progress("Pick up the Pen."))
    upper, lower = drawer(1, 0.0, 1.0, is_open=True), drawer(2, 0.1, 1.0)
    aside = drawer(3, 1.0, 1.0, is_open=True)
    cabinet = thing("Cabinet", 1, 0.0, 1.0, is_open=True)
    seen = memory.update(state(), step(upper, lower, aside, cabinet))
    assert marked(seen, "covered") == {}
    assert marked(seen, "next open") == {"Drawer": 1.0, "Cabinet": 1.0}
    seen = memory.update(state(), step(did=verbs.OPEN, to="Drawer|2"))
    assert marked(seen, "covered") == {"Drawer": count(2)}
    seen = memory.update(state(), step(did=verbs.CLOSE, to="Drawer|1"))
    assert marked(seen, "covered") == {}


def test_what_stands_where_the_thing_may_be() -> None:
    """The nearest kettle counts, and a new subtask has looked nowhere yet."""
    progress = Progress("Put the Mug in the Sink, then pick up the Book.")
    memory = ObjectMap(progress)
    kettles = thing("Kettle", 1, 0.0, 1.0, on="CounterTop"), thing("Kettle", 2, 0.0, 2.0)
    bed = thing("Pillow", 1, 0.0, 3.0, on="Bed")
    seen = memory.update(state(), step(*kettles, bed))
    assert marked(seen, "next on fitting") == {"Kettle": 1.0}  # of a mug
    seen = memory.update(state(ahead=1.0), step())
    assert marked(seen, "next looks") == {"Kettle": count(2)}
    progress.number = 2
    seen = memory.update(state(ahead=4.0), step())
    assert marked(seen, "next on fitting") == {"Pillow": 1.0}  # of a book
    assert marked(seen, "next looks") == {"Pillow": count(1)}
    # In the hand it lies nowhere; it is seen again where it is put.
    seen = memory.update(state(), step(did=verbs.PICKUP, to="Pillow|1"))
    assert "Pillow" not in marked(seen, "unvisited")
    seen = memory.update(state(), step(bed))
    assert marked(seen, "unvisited")["Pillow"] == count(1)


def test_in_a_room_it_knows_where_it_goes_next() -> None:
    """With ``explore``, the environment goes to the nearest that was not visited."""
    options = EnvConfig(episodes="mini", subtasks=True, sightings=True, object_map=True)
    env: Any = make_env(options)
    space = env.observation_space["object_map"]
    assert isinstance(space, spaces.Box)
    assert space.shape == (len(MAP_LAYOUT),)
    random, checked = np.random.default_rng(0), Counter[str]()

    def next_of(place: str) -> str:
        """The nearest known one that was not visited."""
        known = env.policy_observation._map
        at = np.array([obs["state"][SCALARS.index(name)] * 10 for name in ("right", "ahead")])
        fresh = {
            name: float(np.hypot(*(known._facts[:2, column] - at)))
            for name, column in known._column.items()
            if name not in known._visited.get(place, ())
            and KIND_OF[place] == known._facts[2, column]
        }
        return min(fresh, key=fresh.__getitem__, default="")

    env.reset(seed=5)
    for _ in range(8):
        obs, info = env.reset()
        for _ in range(12):
            assert space.contains(obs["object_map"])
            unvisited = marked(obs["object_map"], "unvisited")
            place = str(random.choice(names(info["navigable_mask"])))
            legal = np.flatnonzero(info["action_mask"])
            action = Action(verbs.NAVIGATE, place)
            number = INDEX[action] if random.random() < 0.6 else int(random.choice(legal[1:]))
            following = next_of(place)
            obs, _, over, _, info = env.step(number)
            if number == INDEX[action] and info["action_success"]:
                fewer = marked(obs["object_map"], "unvisited").get(place, 0.0)
                checked["fewer"] += place in unvisited and fewer < unvisited[place]
                checked["all"] += place in unvisited
                checked["next"] += bool(following) and info["object_id"] == following
                checked["any"] += bool(following)
            if over:
                break
    # Unless others of the type come into view.
    assert checked["fewer"] > 0.7 * checked["all"] > 20
    assert checked["next"] > 0.8 * checked["any"] > 20  # or one that was never seen is nearer
    env.close()


def test_a_policy_begins_to_read_it(make_config: Any, tmp_path: Path) -> None:
    """It does the same as before, and what it reads can change that."""
    env = {"episodes": "mini", "types": ["single_pickup"], "subtasks": True, "sightings": True}
    write_untrained_run(make_config(env=env), tmp_path / "run")
    start = {"policy": str(tmp_path / "run")}
    config = make_config(env={**env, "object_map": True}, start=start)
    assert how_learnt(config, 0).endswith("on state and subtask and sightings and map")
    network = starting_network(config, config.start)
    before = load_network(tmp_path / "run" / MODEL)
    wanted = untrained_network(config).state_dict()
    assert {name: each.shape for name, each in network.state_dict().items()} == {
        name: each.shape for name, each in wanted.items()
    }
    room: Any = make_env(config.env)
    seen, _ = room.reset(seed=2)
    obs = {name: torch.as_tensor(each)[None].float() for name, each in seen.items()}
    assert torch.equal(network(obs)[0], before(obs)[0])
    obs["object_map"] = torch.rand(1, len(MAP_LAYOUT))
    numbers, summary = network(obs)
    assert torch.equal(numbers, before(obs)[0])
    assert torch.equal(summary, before(obs)[1])
    numbers.sum().backward()
    gradient = network.row.weight.grad
    assert gradient is not None
    fit = config.network.kind
    assert gradient[:, -fit - len(MAP_FEATURES) : -fit].ne(0).any(dim=0).all()
    room.close()


def test_a_map_needs_sightings() -> None:
    with pytest.raises(ValidationError, match="give sightings=true, too"):
        EnvConfig(subtasks=True, object_map=True)
