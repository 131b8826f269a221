"""Nobody searches for what had been seen, nor guesses where it is."""

from __future__ import annotations

from typing import Any

from support import in_one_test

from er_gym.data.critic import check
from er_gym.data.knowledge import knowledge_at
from er_gym.data.remembered import searches_for_the_seen
from er_gym.data.trajectory import Language, SeenObject, Subgoal, Trajectory, Turn
from er_gym.tasks import verbs

MUG = Subgoal(verb=verbs.PICKUP, thing="Mug", place="Desk")
ON_SHELF = [SeenObject(type="Mug", side="left", distance=1.0, on="Shelf")]
GO = verbs.NAVIGATE


def turn(verb: str, object_type: str = "", **fields: Any) -> Turn:
    plain = {"purpose": "search", "subgoal": MUG, "success": True}
    return Turn(verb=verb, object_type=object_type, **{**plain, **fields})


def course(*turns: Turn, kind: str = "corrected") -> Trajectory:
    return Trajectory.model_construct(
        turns=list(turns), instruction="Find the Mug.", language="en", kind=kind
    )


SEEN = turn(GO, "Bed", view=ON_SHELF, train=False)


@in_one_test(
    "row",
    [  # the turns; the indices of those that search for what had been seen
        ((turn(GO, "Bed"), turn(GO, "Sofa", at="Bed")), []),
        ((SEEN, turn(GO, "Sofa", at="Bed")), [1]),
        ((SEEN, turn(GO, "Shelf", at="Bed")), [1]),  # to go there is no search
        ((SEEN, turn(GO, "Shelf", purpose="approach")), []),
        ((SEEN, turn(verbs.OBSERVE, purpose="look around")), [1]),
        ((SEEN, turn(GO, "Sofa", train=False)), []),
        ((turn(GO, "Bed", views={"left": ON_SHELF}),), [0]),
        ((SEEN, turn(GO, "Sofa", held="Mug")), []),  # now the desk is looked for
        ((turn(GO, "Bed", view=[SeenObject(type="Desk", side="left", distance=1)]),), []),
    ],
)
def test_a_learnt_turn_does_not_search_for_what_was_seen(
    row: tuple[tuple[Turn, ...], list[int]],
) -> None:
    turns, odd = row
    found = list(searches_for_the_seen(course(*turns)))
    assert [int(each.split()[1][:-1]) for each in found] == odd
    assert not list(searches_for_the_seen(course(*turns, kind="played")))


def refused(text: str, language: Language, *, seen: bool, purpose: str = "approach") -> bool:
    now = turn(GO, "Shelf", at="Bed", purpose=purpose)
    before = SEEN if seen else turn(GO, "Bed")
    known = knowledge_at([before, now], 1, instruction="Find the Mug.", language=language)
    return any(each.code == "remembered" for each in check(text, "planning", known, limit=99))


@in_one_test(
    "row",
    [  # a thought; whether it guesses
        ("en", "The mug might be on the shelf.", True),
        ("en", "Someone may have left the mug on the shelf, so I go there.", True),
        ("en", "People often keep a mug on the shelf.", True),
        ("en", "I don't know where the mug is.", True),
        ("en", "I saw the mug on the shelf, so I'll go to the shelf.", False),
        ("en", "The mug should be within reach from the shelf.", False),
        ("en", "The book might be on the shelf.", False),
        ("zh", "马克杯可能在架子上。", True),
        ("zh", "马克杯会在哪里呢？", True),
        ("zh", "之前我看到马克杯在架子上，所以我去架子那里。", False),
        ("zh", "到了架子那里就能够到马克杯。", False),
    ],
)
def test_a_thought_does_not_guess_where_something_is_that_was_seen(
    row: tuple[Language, str, bool],
) -> None:
    language, text, guesses = row
    assert refused(text, language, seen=True) == guesses
    assert not refused(text, language, seen=False)
    assert not refused(text, language, seen=True, purpose="search")  # a mistake on purpose


def test_the_critic_says_where_it_was() -> None:
    now = turn(GO, "Shelf", at="Bed", purpose="approach")
    known = knowledge_at([SEEN, now], 1, instruction="Find the Mug.", language="en")
    (found,) = check("Perhaps the mug is on the sofa.", "planning", known, limit=99)
    assert (found.code, "Shelf" in found.detail) == ("remembered", True)
