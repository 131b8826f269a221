"""What is seen, in words, and the notes of a turn."""

from __future__ import annotations

from dataclasses import replace

from er_gym.data.dialects import load_dialect
from er_gym.data.notes import note
from er_gym.data.scene_text import Perceived, scene_text
from er_gym.data.trajectory import SeenObject, Subgoal, ThoughtRecord, Trajectory, Turn

TEXTS = load_dialect("text").texts["en"]
KITCHEN = Perceived(
    view=[
        SeenObject(type="CounterTop", side="ahead", distance=1),
        SeenObject(type="Mug", side="left", distance=1.1, on="CounterTop"),
        SeenObject(type="Cabinet", side="left", distance=1.2, open=False),
        SeenObject(type="Mug", side="right", distance=1.3, on="CounterTop"),
        SeenObject(type="Cabinet", side="right", distance=1.4, open=True),
        SeenObject(type="Plate", side="right", distance=1.5, on="Cabinet"),
        SeenObject(type="Egg", side="right", distance=1.6, on="Plate"),
        SeenObject(type="Toaster", side="left", distance=4, on="CounterTop", toggled=False),
        SeenObject(type="Fridge", side="left", distance=5, open=False),
    ],
    navigable=["CounterTop", "Cabinet", "Fridge", "Sink"],
    interactable=["Cabinet", "CounterTop", "Egg", "Mug", "Plate"],
)
ALL = (
    "see CounterTop ( Mug, Toaster far off ), Cabinet closed, Cabinet open ( Plate ( Egg ) ), "
    "Fridge away closed\nalso Sink"
)


def told(now: Perceived, before: Perceived | None = None, *, stayed: bool = False) -> str:
    assert TEXTS.scene is not None
    return scene_text(TEXTS.scene, now, before, stayed=stayed)


def test_what_is_in_view_stands_where_it_is() -> None:
    assert told(KITCHEN) == ALL


def test_after_an_action_on_the_spot_only_changes_are_told() -> None:
    opened = [
        each.model_copy(update={"open": True}) if each.type == "Fridge" else each
        for each in KITCHEN.view
    ]
    milk = SeenObject(type="Bowl", side="left", distance=5, on="Fridge")
    now = replace(KITCHEN, view=[*opened, milk], held="Apple")
    assert told(now, KITCHEN, stayed=True) == "see Fridge away open ( Bowl far )\nhold Apple"
    again = replace(now, view=[*now.view, milk.model_copy(update={"type": "Cup"})])
    assert told(again, now, stayed=True) == "see Fridge ( Cup far )\nhold Apple"
    assert told(KITCHEN, KITCHEN, stayed=True) == ""


def test_after_a_walk_all_is_told_again_unless_nothing_has_changed() -> None:
    assert told(KITCHEN, KITCHEN) == ""
    before = replace(KITCHEN, view=KITCHEN.view[:2], navigable=["CounterTop"])
    assert told(KITCHEN, before) == ALL
    assert told(Perceived(), KITCHEN) == "see nothing"


def test_looking_around_tells_what_is_not_ahead() -> None:
    sofa = SeenObject(type="Sofa", side="ahead", distance=3)
    pillow = SeenObject(type="Pillow", side="ahead", distance=3, on="Sofa")
    views = {"right": [sofa, pillow], "behind": [KITCHEN.view[0]], "left": [sofa]}
    now = replace(KITCHEN, views=views, navigable=[*KITCHEN.navigable, "Sofa", "Bed"])
    assert told(now, KITCHEN) == "around Sofa ( Pillow far )\nalso Bed"


def test_things_that_lie_on_one_another_are_all_told() -> None:
    view = [
        SeenObject(type="Bowl", side="ahead", distance=1, on="Plate"),
        SeenObject(type="Plate", side="ahead", distance=1, on="Bowl"),
        SeenObject(type="Book", side="ahead", distance=1, on="Book"),
    ]
    now = Perceived(view=view, interactable=["Bowl", "Plate", "Book"])
    assert told(now) == "see Bowl ( Plate ), Book"


def episode(*turns: Turn, actor: str = "expert") -> Trajectory:
    return Trajectory(
        id="x", task_id="x", task_type="pickup_and_put", scene="FloorPlan1", instruction="Do it.",
        name="", key_actions=[], seed=0, kind="a", actor=actor, max_steps=9, turns=list(turns),
        success=True, end_reason="end",
    )  # fmt: skip


GOAL = Subgoal(verb="pickup", thing="Egg", place="Sink")
FAR = Turn(
    purpose="search", subgoal=GOAL, plan=["Shelf", "Cabinet"], verb="navigate to",
    object_type="Shelf", success=True,
)  # fmt: skip
SEARCHED = FAR.model_copy(update={"plan": ["Cabinet"], "object_type": "Cabinet", "success": False})
NEAR = Turn(
    purpose="take", subgoal=GOAL, verb="pickup", object_type="Egg", view=list(KITCHEN.view),
    interactable=["Egg"], success=True,
)  # fmt: skip
END = Turn(purpose="finish", subgoal=GOAL, held="Egg", verb="end")


def test_a_note_remembers_the_goal_and_where_one_has_looked() -> None:
    assert TEXTS.notes is not None
    whole = episode(FAR, SEARCHED, NEAR, END)
    assert [note(TEXTS.notes, whole, index) for index in range(4)] == [
        ("planning", "goal pickup Egg to Sink; Egg unseen; next Shelf > Cabinet"),
        ("planning", "goal pickup Egg to Sink; Egg unseen; looked Shelf; next Cabinet"),
        (
            "reflection",
            "failed navigate to Cabinet; goal pickup Egg to Sink; Egg near; looked Shelf > Cabinet",
        ),
        ("verification", "goal pickup Egg to Sink; Sink unseen; looked Shelf > Cabinet"),
    ]
    # A fault says nothing about the place.
    slipped = SEARCHED.model_copy(update={"fault": "dropped"})
    assert note(TEXTS.notes, episode(FAR, slipped, END), 2)[1].endswith("looked Shelf")


def test_a_note_counts_how_often_one_has_looked_in_a_place() -> None:
    assert TEXTS.notes is not None
    other = FAR.model_copy(update={"object_type": "Cabinet"})
    whole = episode(FAR, other, FAR, NEAR)
    assert note(TEXTS.notes, whole, 3)[1].endswith("; Egg near; looked Shelf 2 > Cabinet")


def test_a_note_counts_how_often_one_has_just_done_the_same() -> None:
    """Whatever came of it: the environment ends an episode at the fourth time."""
    assert TEXTS.notes is not None
    refused = FAR.model_copy(update={"success": False})
    whole = episode(FAR, FAR, refused, SEARCHED, NEAR)
    told = [note(TEXTS.notes, whole, index)[1] for index in range(5)]
    assert told[1].endswith("; looked Shelf; next Shelf > Cabinet")
    assert told[2].endswith("; looked Shelf 2; navigate to Shelf 2 in a row; next Shelf > Cabinet")
    assert told[3].endswith("; looked Shelf 3; navigate to Shelf 3 in a row; next Cabinet")
    assert "in a row" not in told[4]
    without = TEXTS.notes.model_copy(update={"again": ""})
    assert "in a row" not in note(without, whole, 2)[1]


def test_a_model_that_decided_itself_keeps_its_own_notes() -> None:
    own = [ThoughtRecord(kind="planning", text="mine", writer="hf:x")]
    thinking = FAR.model_copy(update={"thoughts": own})
    dialect = load_dialect("text")
    for actor, words in (("hf:x", "<Planning>mine</Planning>"), ("expert", "Egg unseen")):
        chat = dialect.chat(episode(thinking, END, actor=actor))
        assert words in chat.turns[1].text
    assert dialect.chat(episode(thinking, END, actor="hf:x")).turns[3].text.startswith("<Decision")
