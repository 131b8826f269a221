"""Names of objects in running text."""

from __future__ import annotations

import pytest

from er_gym.data.mentions import find_mentions, named_in


def found(text: str) -> list[tuple[str, set[str]]]:
    return [(each.text, set(each.types)) for each in find_mentions(text)]


@pytest.mark.parametrize(
    ("text", "types"),
    [
        ("the credit card", {"CreditCard"}),
        ("the CreditCard", {"CreditCard"}),
        ("a coffee table", {"CoffeeTable"}),
        ("the shelves", {"Shelf", "ShelvingUnit"}),
        ("two knives", {"Knife", "ButterKnife"}),
        ("the trash can", {"GarbageCan"}),
        ("the remote", {"RemoteControl"}),
        ("床头柜", {"SideTable"}),
        ("水龙头", {"Faucet"}),
        ("打开Fridge门", {"Fridge"}),
    ],
)
def test_a_name_is_found(text: str, types: set[str]) -> None:
    assert [each[1] for each in found(text)] == [types]


def test_the_longest_name_is_meant() -> None:
    assert found("the desk lamp on the desk") == [
        ("desk lamp", {"DeskLamp"}),
        ("desk", {"Desk", "DiningTable", "SideTable"}),
    ]
    assert found("toilet paper holder")[0][0] == "toilet paper holder"
    assert [each[0] for each in found("烤面包机旁边的面包")] == ["烤面包机", "面包"]


def test_a_name_of_several_types_stands_for_all() -> None:
    ((_, table),) = found("the table")
    assert table >= {"DiningTable", "CoffeeTable", "SideTable"}
    ((_, exact),) = found("I see the Knife.")
    assert exact == {"Knife"}


@pytest.mark.parametrize(
    "text",
    [
        "Watch out, it is safe to go on, and I bear in mind what counts.",
        "The key point is to look around; the picture shows little.",
        "It is within range, so I switch it on and put on weight.",
        "我花时间看看地方，画面很清楚，五分钟就够。",
    ],
)
def test_other_words_are_no_names(text: str) -> None:
    assert found(text) == []


def test_places_are_those_of_the_text() -> None:
    text = "I put the  salt shaker down, then the mug."
    assert [text[each.start : each.end] for each in find_mentions(text)] == ["salt shaker", "mug"]


def test_an_instruction_names_types() -> None:
    assert named_in("Put the CreditCard on the ArmChair.") == ("CreditCard", "ArmChair")
    assert named_in("把信用卡放到沙发上。")[0] == "CreditCard"
    assert named_in("Do it.") == ()
