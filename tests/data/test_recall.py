"""What an agent remembers of an episode, and how the dialect ``text-recall`` tells it."""

from __future__ import annotations

from collections import Counter

from er_gym import EmbodiedEnv
from er_gym.data.dialects import load_dialect, user_turn
from er_gym.data.notes import note
from er_gym.data.recall import Recalled
from er_gym.data.scene_text import Perceived
from er_gym.data.trajectory import SeenObject, Subgoal, Trajectory, Turn
from er_gym.envs.actions import Action
from er_gym.envs.info import with_details
from er_gym.tasks import load_suite, verbs

TEXTS = load_dialect("text-recall").texts["en"]
TASK = "Put the Mug in the Box, and the Pen on the Desk."
GO, PUT = verbs.NAVIGATE, verbs.PUT


def sees(kind: str, on: str = "") -> SeenObject:
    return SeenObject(type=kind, side="ahead", distance=1.0, on=on)


def turn(verb: str, kind: str = "", success: bool = True, **fields: object) -> Turn:
    goal = Subgoal(verb=verbs.PICKUP, thing="Mug", place="Box")
    return Turn.model_validate(
        {"purpose": "search", "subgoal": goal, "verb": verb, "object_type": kind}
        | {"success": success, **fields}
    )


KNOWN = ["Box", "Desk", "Drawer", "Mirror", "Plate"]
TURNS = [
    turn(verbs.OBSERVE, view=[sees("Mug", "Shelf"), sees("Drawer")], navigable=KNOWN),
    turn(
        GO, "Drawer", navigable=KNOWN, view=[sees("Mug", "Shelf"), sees("Mug", "Bed")],
        views={"left": [sees("Drawer"), sees("Drawer")], "right": [sees("Drawer"), sees("Pen")]},
    ),
    turn(GO, "Desk", False, view=[sees("Drawer")], navigable=KNOWN),
    turn(GO, "Drawer", navigable=KNOWN),
    turn(GO, "Desk", navigable=["Desk", "Mug"], held="Mug"),
    turn(PUT, "Desk", navigable=["Desk", "Mug"], interactable=["Desk"], held="Mug"),
    turn(verbs.END, navigable=["Desk", "Mug"]),
]  # fmt: skip


def told(turns: list[Turn]) -> list[list[str]]:
    """The lines of the memory, at each turn."""
    lines: list[list[str]] = []
    before: Perceived | None = None
    for index, each in enumerate(turns):
        now = Perceived.at(each, turns[index - 1] if index else None, before)
        (text,) = user_turn(TEXTS, TASK, None, [], now, before)
        *scene, named, places = str(text).splitlines()
        assert all(scene), "no line for what is not told"
        lines.append([named, places])
        before = now
    return lines


def test_the_user_tells_where_things_were_seen_and_where_the_agent_has_been() -> None:
    assert told(TURNS) == [
        [
            "asked Mug in view far at far Shelf, Box seen, Pen hidden, Desk seen",
            "places Box, Desk, Drawer",  # a mirror holds nothing, and a plate is carried
        ],
        [
            "asked Mug in view far at far Shelf, Box seen, Pen in view far, Desk seen",
            "places Box, Desk, Drawer",
        ],
        [
            "asked Mug seen far at far Shelf, Box seen, Pen seen far, Desk seen",
            "places Box, Desk, Drawer 1/2",  # the most in one view, since views overlap
        ],
        [  # the walk to the desk failed
            "asked Mug seen far at far Shelf, Box seen, Pen seen far, Desk seen",
            "places Box, Desk, Drawer 1/2",
        ],
        ["asked Mug held, Box hidden, Pen seen far, Desk seen", "places Desk"],
        ["asked Mug held, Box hidden, Pen seen far, Desk near", "places Desk 1"],
        ["asked Mug seen at Desk, Box hidden, Pen seen far, Desk seen", "places Desk 1"],
    ]


def trajectory(turns: list[Turn]) -> Trajectory:
    return Trajectory(
        id="x", task_id="x", task_type="pickup_and_put", scene="FloorPlan1", instruction=TASK,
        name="", key_actions=[], seed=0, kind="a", actor="expert", max_steps=9, turns=turns,
        success=True, end_reason="end",
    )  # fmt: skip


def noted(turns: list[Turn], index: int) -> str:
    assert TEXTS.notes is not None
    return note(TEXTS.notes, trajectory(turns), index)[1]


def test_a_note_says_where_the_thing_was_seen_and_not_where_one_has_looked() -> None:
    """In the user's words, so that it can be copied."""
    assert [noted(TURNS, index) for index in (1, 2, 3)] == [
        "goal pickup Mug to Box; Mug in view far at far Shelf",
        "goal pickup Mug to Box; Mug seen far at far Shelf",
        "failed navigate to Desk; goal pickup Mug to Box; Mug seen far at far Shelf",
    ]


def test_a_note_does_not_take_a_sink_for_its_basin() -> None:
    goal = Subgoal(verb=verbs.PUT, thing="Egg", place="SinkBasin")
    view = [sees("SinkBasin", "Sink"), sees("Sink", "CounterTop")]
    here = turn(GO, "Sink", subgoal=goal, held="Egg", view=view, navigable=["SinkBasin", "Sink"])
    assert noted([here], 0) == "goal put in Egg to SinkBasin; SinkBasin in view at Sink"


def test_only_what_was_done_is_remembered() -> None:
    been = Recalled().having_done(Action(GO, "Bed"), True, "")
    assert been.visits == {"Bed": 1}
    assert been.having_done(None, True, "") == been
    assert been.having_done(Action(GO, "Bed"), False, "") == been
    assert been.having_done(Action(PUT, "Bed"), False, "Pen") == been
    assert been.having_done(Action(PUT, "Bed"), True, "Pen").lay == {"Pen": "Bed"}
    assert been.having_done(Action(GO, "Bed"), True, "").visits == {"Bed": 2}
    assert been.having_done(Action(verbs.CLOSE, "Bed"), True, "") == been
    opened = been.having_done(Action(verbs.OPEN, "Bed"), True, "")
    assert (opened.opened, opened.visits) == ({"Bed": 1}, been.visits)
    assert opened.having_done(Action(verbs.OPEN, "Bed"), False, "") == opened
    assert opened.having_done(Action(verbs.OPEN, "Bed"), True, "").opened == {"Bed": 2}


def test_the_user_tells_how_often_places_were_opened() -> None:
    opened = [turn(GO, "Drawer"), turn(verbs.OPEN, "Drawer"), turn(verbs.OPEN, "Box"), turn(GO)]
    seen = [each.model_copy(update={"navigable": KNOWN}) for each in opened]
    assert [places for _, places in told(seen)] == [
        "places Box, Desk, Drawer",
        "places Box, Desk, Drawer 1",
        "places Box, Desk, Drawer 1 open 1",
        "places Box open 1, Desk, Drawer 1 open 1",
    ]


def test_the_chinese_words() -> None:
    texts = load_dialect("text-recall").texts["zh"]
    here = turn(verbs.OPEN, "Drawer", view=[sees("Mug", "Shelf")], navigable=["Drawer"])
    first = Perceived.at(here)
    now = Perceived.at(here, here, first)
    (text,) = user_turn(texts, TASK, None, [], now, first)
    *_, named, places = str(text).splitlines()
    assert named.startswith("所求 Mug 可见 远 在远处 Shelf,")
    assert places == "地点 Drawer 打开 1"
    whole = trajectory([here]).model_copy(update={"language": "zh"})
    assert texts.notes is not None
    assert note(texts.notes, whole, 0)[1] == "目标 pickup Mug 到 Box; Mug 可见 远 在远处 Shelf"


def test_a_thing_can_lie_where_one_cannot_go() -> None:
    here = turn(GO, "Bed", view=[sees("Mug", "Shelf")], navigable=["Bed"])
    there = here.model_copy(update={"navigable": ["Bed", "Shelf"]})
    assert told([here])[0][0].startswith("asked Mug in view far at far Shelf,")
    assert noted([here], 0) == "goal pickup Mug to Box; Mug in view far at far Shelf"
    assert told([there])[0][0].startswith("asked Mug in view far at Shelf,")
    assert noted([there], 0) == "goal pickup Mug to Box; Mug in view far at Shelf"


def test_what_was_sliced_is_forgotten() -> None:
    bread = Recalled({"Bread": "Plate"})
    assert bread.having_done(Action(verbs.SLICE, "Bread"), False, "Knife") == bread
    assert bread.having_done(Action(verbs.SLICE, "Bread"), True, "Knife").lay == {}


def test_what_is_ahead_and_near_comes_first() -> None:
    ahead = [sees("Mug", "Bed"), sees("Mug", "Desk")]
    around = {"right": [sees("Mug", "Sofa"), sees("Pen", "Sofa")], "left": [sees("Pen", "Bed")]}
    assert Recalled().having_seen(ahead, around).lay == {"Mug": "Bed", "Pen": "Sofa"}


def test_a_task_may_say_what_the_agent_can_go_to() -> None:
    """Also types that no room has."""
    now = Perceived(navigable=["Bookshelf", "Desk", "Pen"])
    (text,) = user_turn(TEXTS, TASK, None, [], now)
    assert str(text).splitlines()[-2:] == [
        "asked Mug hidden, Box hidden, Pen seen, Desk seen",
        "places Desk",
    ]


def test_a_look_around_counts_no_object_twice() -> None:
    env = EmbodiedEnv("mini", obs_mode="objects")
    for task in load_suite("mini").tasks[::40]:
        _, info = env.reset(options={"task": task})
        before, seen = Perceived.of(with_details(env, info)), set()
        for action in (Action(verbs.OBSERVE), Action(verbs.OBSERVE)):
            info = with_details(env, env.step(action)[-1])
            before = Perceived.of(info, before)
            views = (info["object_views"], *info["object_views_around"].values())
            seen |= {(each.object_type, each.object_id) for view in views for each in view}
        there = Counter(kind for kind, _ in seen)
        assert all(count <= there[kind] for kind, count in before.recalled.most_in_view.items())
    env.close()
