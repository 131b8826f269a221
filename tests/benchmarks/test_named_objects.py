"""Instructions name what their tasks are about, and no other type."""

from __future__ import annotations

from dataclasses import replace

from support import make_task

from benchmarks.checks.named_objects import about, named, named_in, naming_table
from er_gym.tasks.goal import Condition
from er_gym.tasks.wordings.names import types_named_in

ROLL = "ToiletPaper|+00.00|+01.00|+02.00"
TASK = make_task(
    "pickup_from_closerep_and_put",
    *(
        ("navigate to", "Cabinet|1"),
        ("open", "Cabinet|1"),
        ("pickup", ROLL),
        ("close", "Cabinet|1"),
    ),
    *(("navigate to", "Shelf|1"), ("put in", "Shelf|1")),
    goal=(Condition("ToiletPaper", inside="Shelf"),),
)


def said(text: str) -> tuple[set[str], set[str]]:
    found = named(replace(TASK, instruction=text))
    return {*found.lacking}, {*found.foreign}


def test_names_are_read_in_any_spelling_and_the_longest_first() -> None:
    assert types_named_in("Put the TOILET ROLL on the toilet paper hanger.") == {
        "ToiletPaper",
        "ToiletPaperHanger",
    }
    assert types_named_in("把书桌上的书放到架子上。") == {"Desk", "Book", "Shelf"}
    assert types_named_in("Go to the bedroom, and watched pens are no matter.") == set()


def test_a_task_is_about_its_goal_and_not_about_what_hides_it() -> None:
    assert about(TASK) == {"ToiletPaper", "Shelf"}
    one = replace(TASK, goal=(Condition("ToiletPaper", ROLL, inside="Shelf"),))
    assert about(one) == {"ToiletPaper", "Shelf", "Cabinet"}


def test_what_an_instruction_lacks_and_what_is_foreign_to_it_is_told() -> None:
    assert said("Put the toilet roll on the shelf.") == (set(), set())
    assert said("Put the toilet roll away.") == ({"Shelf"}, set())
    assert said("Take the loo paper and the mug to the shelf.") == ({"ToiletPaper"}, {"Mug"})
    assert said("把柜子里的卫生纸放到架子上。") == (set(), {"Cabinet"})
    (words,) = named(replace(TASK, instruction="Put it on the shelf.")).problems
    assert words == "'Put it on the shelf.' does not name ToiletPaper"


def test_every_instruction_of_mini_names_exactly() -> None:
    assert [words for one in named_in("mini") for words in one.problems] == []
    assert naming_table(["mini"]).rows == (
        ("mini", "en", "132", "132", "0", "0"),
        ("mini", "zh", "132", "132", "0", "0"),
    )
