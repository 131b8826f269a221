"""What a user's message of a training file says."""

from __future__ import annotations

from support import in_one_test

from er_gym.data.parse_conversation import UserMessage, language_of, thoughts_of, user_message


@in_one_test(
    "row",
    [
        ('Task: "Find the Egg."', "Find the Egg."),
        ("Task: “Find the Egg.”\nLook.", "Find the Egg."),
        ("Think. Task: 'Find the Egg.' Available_Actions: {}", "Find the Egg."),
        ("Task: Find the Egg. \nLook.", "Find the Egg."),
        ("task is: x", "task is: x"),  # no task is named: the first line
        ("<image>Find the Egg.\nNow.", "Find the Egg."),
        ("Task: " + "x" * 400, "x" * 300),
    ],
)
def test_the_first_message_tells_the_task(row: tuple[str, str]) -> None:
    text, task = row
    assert user_message(text, first=True, shows=True) == UserMessage(task=task)


@in_one_test(
    "row",
    [
        ("<|feedback|>It is  shut.\nTry on.", True, (True, "It is shut. Try on.")),
        ("You cannot. <|feedback|>", True, (True, "You cannot.")),
        ("<image>After your pickup.", True, (False, "")),
        ("After your pickup.", False, (True, "After your pickup.")),
    ],
)
def test_a_later_message_tells_what_failed(row: tuple[str, bool, tuple[bool, str]]) -> None:
    text, shows, (failed, feedback) = row
    found = user_message(text, first=False, shows=shows)
    assert (found.failed, found.feedback, found.task) == (failed, feedback, "")


def test_the_language_is_that_of_a_tenth_of_the_characters() -> None:
    assert language_of("Find it 鸡") == "zh"
    assert language_of("Find the 鸡") == "en"  # one of ten is not more than a tenth
    assert language_of("") == "en"


def test_the_papers_openers_are_part_of_what_is_said() -> None:
    said = "Hang on, a lamp. Let me double-check: it is on. Okay, I've decided."
    found = [(each.kind, each.text) for each in thoughts_of(said, "en", first=False)]
    assert found == [
        ("reasoning", "Hang on, a lamp."),
        ("verification", "Let me double-check: it is on."),
    ]
    tagged = "<Planning>Go.</Planning> <Reasoning> </Reasoning><Reflection>No.</Reflection>"
    found = [(each.kind, each.text) for each in thoughts_of(tagged, "en", first=True)]
    assert found == [("planning", "Go."), ("reflection", "No.")]
