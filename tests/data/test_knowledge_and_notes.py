"""What an agent knows at a turn, and the note that a small model writes of it: turns by hand."""

from __future__ import annotations

from typing import Any

from support import in_one_test

from er_gym.data.knowledge import Knowledge, Visit, knowledge_at
from er_gym.data.notes import NoteWords, note
from er_gym.data.trajectory import SeenObject, Subgoal, Trajectory, Turn
from er_gym.tasks import verbs

MUG = Subgoal(verb=verbs.PICKUP, thing="Mug", place="Sink")
EGG = Subgoal(verb=verbs.PICKUP, thing="Egg")
WORDS = NoteWords(
    goal="goal {verb} {thing}",
    to=" to {place}",
    held="{thing} held",
    near="{thing} near",
    view="{thing} in view",
    seen="{thing} seen",
    unseen="{thing} unseen",
    looked="looked {places}",
    times="{place} {count}",
    again="{action} {count} in a row",
    next="next {places}",
    failed="failed {action}",
    places_separator=" > ",
)


def turn(verb: str, object_type: str = "", **fields: Any) -> Turn:
    """A turn of the search for the mug; it succeeds."""
    plain = {"purpose": "search", "subgoal": MUG, "success": True}
    return Turn(verb=verb, object_type=object_type, **{**plain, **fields})


def known(*turns: Turn) -> Knowledge:
    return knowledge_at(turns, len(turns) - 1, instruction="Find the Mug.", language="en")


def seen(*types: str) -> list[SeenObject]:
    return [SeenObject(type=each, side="ahead", distance=1.0) for each in types]


GO, OPEN = verbs.NAVIGATE, verbs.OPEN


@in_one_test(
    "row",
    [
        ([turn(GO, "Sink"), turn(GO, "Desk")], [Visit("Sink", 0), Visit("Desk", 1)]),
        (
            [turn(GO, "Sink"), turn(GO, "Fridge"), turn(OPEN, "Fridge")],
            [Visit("Sink", 0), Visit("Fridge", 1, opened=True)],
        ),
        (
            [turn(GO, "Fridge", reward=1.0), turn(OPEN, "Fridge")],
            [Visit("Fridge", 0, opened=True, found=True)],
        ),
        (
            [turn(GO, "Fridge"), turn(OPEN, "Fridge", reward=1.0)],
            [Visit("Fridge", 0, opened=True, found=True)],
        ),
        ([turn(GO, "Fridge"), turn(OPEN, "Drawer")], [Visit("Fridge", 0)]),
        ([turn(OPEN, "Fridge")], []),
        ([turn(GO, "Fridge"), turn(OPEN, "Fridge", success=False)], [Visit("Fridge", 0)]),
        ([turn(GO, "Sink", success=False)], []),
        ([turn(GO, "Sink", subgoal=EGG)], []),
        ([turn(GO, "Sink", purpose="carry")], []),
        ([turn(GO, "Sink", purpose="approach")], [Visit("Sink", 0)]),
        ([turn(GO, "Sink", purpose="retry")], [Visit("Sink", 0)]),
        ([turn(verbs.OBSERVE)], []),
    ],
)
def test_the_places_searched_for_what_is_wanted_now(row: tuple[list[Turn], list[Visit]]) -> None:
    before, visits = row
    assert known(*before, turn(GO, "Bed")).visits == visits


def test_a_thing_was_seen_last_where_the_agent_was_then() -> None:
    found = known(
        turn(GO, "Sink", view=seen("Mug", "Egg")),
        turn(GO, "Desk", at="Sink", view=seen("Egg"), views={"left": seen("Book")}),
        turn(GO, "Bed", at="Desk", view=seen("Lamp")),
    )
    assert found.seen == {"Mug": "", "Egg": "Sink", "Book": "Sink", "Lamp": "Desk"}
    assert found.in_view == {"Lamp"}
    around = known(turn(GO, "Bed", view=seen("Mug"), views={"left": seen("Book")}))
    assert around.in_view == {"Mug", "Book"}


def told(*turns: Turn) -> tuple[str, list[str]]:
    trajectory = Trajectory.model_construct(
        turns=list(turns), instruction="Find the Mug.", language="en"
    )
    kind, text = note(WORDS, trajectory, len(turns) - 1)
    return kind, text.split("; ")


GOAL = "goal pickup Mug to Sink"


@in_one_test(
    "row",
    [
        ({"view": seen("Desk")}, "Mug unseen"),
        ({"view": seen("Mug")}, "Mug in view"),
        ({"views": {"left": seen("Mug")}}, "Mug in view"),
        ({"view": seen("Mug"), "interactable": ["Mug"]}, "Mug near"),
        ({"held": "Mug"}, "Sink unseen"),  # in the hand, it is to be brought there
        ({"held": "Mug", "view": seen("Sink")}, "Sink in view"),
        ({"held": "Egg"}, "Mug unseen"),
        ({"held": "Mug", "subgoal": Subgoal(verb="pickup", thing="Mug")}, "Mug held"),
    ],
)
def test_how_far_it_is(row: tuple[dict[str, Any], str]) -> None:
    fields, expected = row
    kind, (goal, far) = told(turn(GO, "Desk", **fields))
    assert kind == "planning"
    assert goal == GOAL.removesuffix("" if "subgoal" not in fields else " to Sink")
    assert far == expected


def test_what_was_seen_before_is_seen() -> None:
    _, (_, far, *_) = told(turn(GO, "Desk", view=seen("Mug")), turn(GO, "Bed"))
    assert far == "Mug seen"


@in_one_test(
    "row",
    [
        ([], None),
        ([turn(GO, "Sink")], "looked Sink"),
        ([turn(GO, "Sink"), turn(GO, "Desk"), turn(GO, "Sink")], "looked Sink 2 > Desk"),
        # where it was refused to go counts, for the same thing and without a fault
        ([turn(GO, "Bed", success=False), turn(GO, "Desk")], "looked Bed > Desk"),
        ([turn(GO, "Bed", success=False, subgoal=EGG)], None),
        ([turn(GO, "Bed", success=False, fault="slip")], None),
        ([turn(OPEN, "Bed", success=False)], None),
        ([turn(GO, "Sink", subgoal=EGG)], None),
    ],
)
def test_where_it_has_looked(row: tuple[list[Turn], str | None]) -> None:
    before, expected = row
    _, parts = told(*before, turn(GO, "Fridge"))
    assert [each for each in parts if each.startswith("looked")] == ([expected] if expected else [])


def test_what_failed_what_is_repeated_and_what_comes_next() -> None:
    again = [turn(GO, "Bed", success=False, fault="slip")] * 3
    plan = ["Fridge", "Desk", "Fridge", "Shelf", "Sofa", "Box"]
    kind, parts = told(turn(GO, "Sink"), *again, turn(GO, "Fridge", plan=plan))
    assert kind == "reflection"
    assert parts == [
        "failed navigate to Bed",
        GOAL,
        "Mug unseen",
        "looked Sink",
        "navigate to Bed 3 in a row",
        "next Fridge > Desk > Shelf > Sofa",
    ]
    kind, parts = told(turn(GO, "Sink"), turn(verbs.END, subgoal=Subgoal()))
    assert (kind, parts) == ("verification", [""])
    kind, parts = told(turn(GO, "Sink", success=False, fault="slip"), turn(verbs.END))
    assert kind == "reflection"
    assert "in a row" not in " ".join(parts)  # once is not again
