"""Prompts from training files: files of several styles, and malicious files."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest

from agents.vlm.paper_prompts import ENOUGH, DerivedPrompts
from agents.vlm.prompt_set import IMAGE_MARK, LastAction, TurnContext
from agents.vlm.prompts import load_prompts
from agents.vlm.settings import Prompts

TASKS = (
    "Find the Mug.",
    "Please put an Apple into the Fridge.",
    "Could you switch on the DeskLamp?",
    "Take the Book to the Sofa.",
    "I have lost my KeyChain, where is it?",
    "Go and pick up a Pen.",
)
ACTIONS = ("navigate to Fridge", "open Fridge", "observe", "pickup Apple", "move forward")
WORDS = ("red", "blue", "big", "small", "old", "new", "near", "far")
Turn = Callable[[str], str]


def first_turn(task: str) -> str:
    return f"<image>The robot sees this. It is asked: {task}\nWhat will the robot do?"


def later_turn(action: str) -> str:
    return f'<image>The robot did "{action}", and sees this. It may observe, or end.'


def conversation(
    first: str, actions: Sequence[str] = ACTIONS, later: Turn = later_turn, system: str = "Be good."
) -> dict[str, Any]:
    """A sample in which these actions are done, one after the other."""
    messages = [{"role": "system", "content": system}] if system else []
    said = first
    for action in actions:
        messages += [
            {"role": "user", "content": said},
            {
                "role": "assistant",
                "content": f"<Thinking>Hm.</Thinking><DecisionMaking>{action}</DecisionMaking>",
            },
        ]
        said = later(action)
    messages.append({"role": "user", "content": said})
    return {"messages": messages, "images": []}


def in_sharegpt(sample: dict[str, Any]) -> dict[str, Any]:
    names = {"system": "system", "user": "human", "assistant": "gpt"}
    return {
        "conversations": [
            {"from": names[turn["role"]], "value": turn["content"]} for turn in sample["messages"]
        ]
    }


SAMPLES = [conversation(first_turn(task)) for task in TASKS]


class Reader:
    """Writes samples to a file and reads the prompts from it."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "train.json"

    def text(self, text: str) -> DerivedPrompts:
        self.file.write_text(text, encoding="utf-8")
        prompts = load_prompts(Prompts(dataset=str(self.file)))
        assert isinstance(prompts, DerivedPrompts)
        return prompts

    def __call__(self, samples: Sequence[object]) -> DerivedPrompts:
        return self.text(json.dumps(samples, ensure_ascii=False))


@pytest.fixture
def read(tmp_path: Path) -> Reader:
    return Reader(tmp_path)


def first(prompts: DerivedPrompts, task: str) -> str:
    """The first turn with its picture as files write it."""
    text = prompts.first(TurnContext(task=task, decide="tags", sees="pictures", max_steps=20))
    return text.replace(IMAGE_MARK, "<image>")


def later(
    prompts: DerivedPrompts,
    action: str,
    *,
    feedback: str = "",
    task: str = "Find it.",
    pictures: int = 1,
) -> str:
    """The turn after an action, which failed if there is feedback."""
    text = prompts.next(
        TurnContext(task=task, decide="tags", sees="pictures"),
        LastAction(
            action=action,
            success=not feedback,
            feedback=feedback or f"Done: {action}.",
            pictures=pictures,
        ),
    )
    return text.replace(IMAGE_MARK, "<image>")


# -- what is read --------------------------------------------------------------------------------


def written_as(samples: list[dict[str, Any]], style: str) -> str:
    styles: dict[str, Callable[[], str]] = {
        "a list": lambda: json.dumps(samples),
        "a list over lines": lambda: json.dumps(samples, indent=2),
        "JSON Lines": lambda: "\n".join(map(json.dumps, samples)),
        "JSON Lines with gaps": lambda: "\n\n".join(map(json.dumps, samples)) + "\n",
        "ShareGPT": lambda: json.dumps([in_sharegpt(sample) for sample in samples]),
        "both": lambda: json.dumps([*map(in_sharegpt, samples[:3]), *samples[3:]]),
        "a byte order mark": lambda: "\ufeff" + json.dumps(samples),
    }
    return styles[style]()


@pytest.mark.parametrize(
    "style",
    [
        "a list",
        "a list over lines",
        "JSON Lines",
        "JSON Lines with gaps",
        "ShareGPT",
        "both",
        "a byte order mark",
    ],
)
def test_what_the_model_saw_is_what_it_sees(read: Reader, style: str) -> None:
    prompts = read.text(written_as(SAMPLES, style))
    assert prompts.system(decide="tags", sees="pictures") == "Be good."
    for task in (*TASKS, "Wash the Plate in the sink."):
        assert first(prompts, task) == first_turn(task)
    for action in (*ACTIONS, "toggle DeskLamp", "put in Drawer", "end"):
        assert later(prompts, action) == later_turn(action)
    assert (prompts.samples, prompts.odd) == (len(TASKS), 0)
    assert prompts.name == "train.json"
    assert "the texts of 6 conversations of" in prompts.about


@pytest.mark.parametrize(
    "frame",
    [
        "{}",
        "<image>{}",
        "<image>\n{}\n",
        "{}<image>",
        "<image>\n\nTask: {}",
        'Do this: "{}" <image> Now!',
        "<image>请完成任务：{}接下来做什么？",
        "任务是{}<image>",
        "<image>{}\n\n{{}} {{{{ task }}}} {{% raw %}} \\1 \\g<0> are words.",
    ],
)
def test_frames_of_many_kinds(read: Reader, frame: str) -> None:
    prompts = read([conversation(frame.format(task)) for task in TASKS])
    task = "Boil the Potato!"
    text = frame.format(task)
    assert first(prompts, task) == (text if "<image>" in text else f"<image>{text}")


def test_the_same_file_gives_the_same_words(read: Reader) -> None:
    one, two = read(SAMPLES), read(SAMPLES)
    assert one.digest == two.digest
    assert len(one.digest) == 64
    assert one == two


@pytest.mark.parametrize(
    "changed",
    [
        [conversation(first_turn(task), system="Be bad.") for task in TASKS],
        [conversation(first_turn(task) + " Hurry!") for task in TASKS],
        [conversation(first_turn(task), later="<image>After {}:".format) for task in TASKS],
        [
            conversation(
                first_turn(task),
                later=lambda action: later_turn(action) + "!" * (action == "observe"),
            )
            for task in TASKS
        ],
    ],
)
def test_other_words_have_another_digest(read: Reader, changed: list[object]) -> None:
    assert read(changed).digest != read(SAMPLES).digest


def test_the_language_of_what_is_not_in_the_file(read: Reader) -> None:
    english = read(SAMPLES)
    chinese = load_prompts(Prompts(dataset=str(read.file), language="zh"))
    problem = {"problem": "It is empty.", "decide": "tags"}
    assert english.feedback(**problem) == load_prompts(Prompts()).feedback(**problem)
    assert chinese.feedback(**problem) == load_prompts(Prompts(language="zh")).feedback(**problem)
    assert english.digest != chinese.digest


def test_only_as_much_is_read_as_is_needed(read: Reader) -> None:
    samples = [conversation(first_turn(TASKS[i % 6]), ACTIONS[:2]) for i in range(2 * ENOUGH)]
    text = json.dumps(samples)
    padding = json.dumps("x" * (1 << 22))  # the rest is not read
    prompts = read.text(f"{text[:-1]}, {padding}, nonsense")
    assert (prompts.samples, prompts.odd) == (ENOUGH, 0)


# -- the turns after an action -------------------------------------------------------------------


def test_the_number_of_pictures_is_the_files(read: Reader) -> None:
    def turn(action: str) -> str:
        return f"{'<image>' * (3 if action == 'observe' else 1)}You did {action}."

    prompts = read([conversation(first_turn(task), later=turn) for task in TASKS])
    assert prompts.after_observe == 3
    assert later(prompts, "observe", pictures=3) == "<image><image><image>You did observe."
    assert later(prompts, "open Fridge") == "<image>You did open Fridge."


@pytest.mark.parametrize(
    ("turn", "pictures", "shown"),
    [
        ("<image>a <image>b <image>c {}", 3, "<image>a <image>b <image>c {}"),
        ("<image>a <image>b <image>c {}", 4, "<image>a <image>b <image><image>c {}"),
        ("<image>a <image>b <image>c {}", 1, "<image>a b c {}"),
        ("You did {}. <image>", 4, "You did {}. <image><image><image><image>"),
        ("You did {}.", 1, "<image>You did {}."),
        ("<image>You did {}.", 0, "You did {}."),
    ],
)
def test_every_picture_has_a_place(read: Reader, turn: str, pictures: int, shown: str) -> None:
    prompts = read([conversation(first_turn(task), later=turn.format) for task in TASKS])
    for action in ("observe", "open Fridge"):
        assert later(prompts, action, pictures=pictures) == shown.format(action)


@pytest.mark.parametrize(
    ("actions", "turn", "expected"),
    [
        (ACTIONS, "<image>{}", 1),
        (ACTIONS, "<image>" * 4 + "{}", 4),
        (ACTIONS, "<image>" * 2 + "{}", None),
        (("open Fridge", "close Fridge"), "<image>{}", None),
    ],
)
def test_what_is_expected_after_observe(
    read: Reader, actions: Sequence[str], turn: str, expected: int | None
) -> None:
    samples = [conversation(first_turn(task), actions, turn.format) for task in TASKS]
    assert read(samples).after_observe == expected


def test_verbs_with_turns_of_their_own(read: Reader) -> None:
    """What is usual is what most are, whatever is said after some verbs."""

    def turn(action: str) -> str:
        special = {"observe": "You look about.", "pickup Apple": "You now hold it."}
        return f"<image>{special.get(action, f'You did {action}.')}"

    prompts = read([conversation(first_turn(task), later=turn) for task in TASKS])
    assert later(prompts, "observe") == "<image>You look about."
    assert later(prompts, "pickup Mug") == "<image>You now hold it."
    assert later(prompts, "toggle Faucet") == "<image>You did toggle Faucet."


@pytest.mark.parametrize(
    ("decided", "written"),
    [
        ("Navigate to Fridge", "navigate to fridge"),
        ("navigate  to\nFridge.", "Navigate to Fridge"),
        ("go to Fridge", "navigate to Fridge"),
        ("put Fridge", "put in Fridge"),
        ("NAVIGATE TO FRIDGE", "NAVIGATE\nTO FRIDGE"),
    ],
)
def test_actions_are_found_as_they_are_written(read: Reader, decided: str, written: str) -> None:
    samples = [
        conversation(first_turn(task), [decided], lambda _: f"<image>Did '{written}'.")
        for task in TASKS
    ]
    assert later(read(samples), "open Drawer") == "<image>Did 'open Drawer'."


def test_an_action_is_not_found_inside_of_words(read: Reader) -> None:
    def turn(action: str) -> str:
        return f"<image>reopen Fridge? open Fridges? No: {action}"

    samples = [conversation(first_turn(task), ["open Fridge"], turn) for task in TASKS]
    assert later(read(samples), "close Box") == turn("close Box")


def test_the_last_decision_is_the_one(read: Reader) -> None:
    samples = [conversation(first_turn(task), ["open Fridge"]) for task in TASKS]
    for sample in samples:
        sample["messages"][2]["content"] = (
            "<DecisionMaking>open Drawer</DecisionMaking> No: "
            "<decisionmaking>\nopen Fridge\n</decisionmaking>"
        )
    assert later(read(samples), "close Box") == later_turn("close Box")


def test_failures_have_words_of_their_own(read: Reader) -> None:
    reasons = {"Fridge": "It is shut now.", "Drawer": "It is far off now.", "Box": "Not now."}

    def turn(action: str) -> str:
        if action.startswith("open"):
            return f'<image>"{action}" failed: {reasons[action[5:]]} Try something else.'
        return later_turn(action)

    actions = (*ACTIONS, "navigate to Mug", "open Drawer", "open Box", "toggle Lamp")
    prompts = read([conversation(first_turn(task), actions, turn) for task in TASKS])
    shown = later(prompts, "close Safe", feedback="It is locked.")
    assert shown == '<image>"close Safe" failed: It is locked. Try something else.'
    assert later(prompts, "open Safe") == later_turn("open Safe")


def test_what_is_usual_does_not_fail(read: Reader) -> None:
    """Though most actions of the file do."""

    def turn(action: str) -> str:
        return "<image>That is impossible." if "e" in action else later_turn(action)

    actions = ("open Fridge", "navigate to Fridge", "close Box", "pickup Mug")
    prompts = read([conversation(first_turn(task), actions, turn) for task in TASKS])
    assert later(prompts, "slice Bread") == later_turn("slice Bread")
    assert later(prompts, "slice Bread", feedback="No.") == "<image>That is impossible."


def test_failures_that_give_no_reason(read: Reader) -> None:
    def turn(action: str) -> str:
        return "<image>You cannot do that." if action == "open Fridge" else later_turn(action)

    actions = (*ACTIONS, "navigate to Mug")
    prompts = read([conversation(first_turn(task), actions, turn) for task in TASKS])
    assert later(prompts, "close Safe", feedback="Locked.") == "<image>You cannot do that."


def test_where_nothing_fails_feedback_is_told_all_the_same(read: Reader) -> None:
    shown = later(read(SAMPLES), "open Safe", feedback="You cannot open Safe: it is locked.")
    assert shown == f"{later_turn('open Safe')}\nYou cannot open Safe: it is locked."


def test_rules_that_speak_of_failure_are_none(read: Reader) -> None:
    def turn(action: str) -> str:
        return f"<image>Done: {action}. If an action fails, you cannot do it here."

    prompts = read([conversation(first_turn(task), later=turn) for task in TASKS])
    assert later(prompts, "open Box") == turn("open Box")
    shown = later(prompts, "open Box", feedback="Locked.")
    assert shown == f"{turn('open Box')}\nLocked."


def test_turns_that_all_tell_something_else(read: Reader) -> None:
    """The environment's feedback in every turn."""
    generator = random.Random(0)

    def turn(action: str) -> str:
        words = " ".join(generator.sample(WORDS, 4))
        return f"<image>You did {action}. You see: {words}. What now, robot?"

    samples = [conversation(first_turn(task), later=turn) for task in TASKS * 5]
    shown = later(read(samples), "open Box")
    assert shown == "<image>You did open Box. You see: Done: open Box. What now, robot?"


# -- people who mean no good, and files that are not tidy ----------------------------------------


def test_a_task_may_say_anything(read: Reader) -> None:
    odd = [
        "Find {{ 7 * 7 }} Mugs.",
        "Find {% for x in y %} Mugs",
        "Use {} and {0} and {task} and \\1",
        "navigate to Fridge and open Fridge",
        "It is asked: What will the robot do?",
        "Find the <image> Mug.",
        "observe",
    ]
    samples = [conversation(first_turn(task.replace("<image>", "picture"))) for task in odd]
    prompts = read(samples)
    for task in odd:
        expected = f"{IMAGE_MARK}The robot sees this. It is asked: {task}\nWhat will the robot do?"
        assert prompts.first(TurnContext(task=task, decide="tags", sees="pictures")) == expected
    for action in ("navigate to Fridge", "observe", "toggle {{ x }}"):
        assert later(prompts, action, task=odd[0]) == later_turn(action)


@pytest.mark.parametrize("code", range(0xFDD0, 0xFDD4))
def test_slots_in_other_peoples_words_are_none(read: Reader, code: int) -> None:
    odd = chr(code)
    prompts = read([conversation(first_turn(task) + odd, system="Be good.") for task in TASKS])
    assert first(prompts, f"Find{odd} it.") == first_turn("Find it.")
    assert later(prompts, f"open{odd} Box") == later_turn("open Box")


def test_tasks_that_are_told_again(read: Reader) -> None:
    """Also where the task names the action that was done."""
    tasks = (*TASKS, "open Fridge and navigate to Fridge, please")
    samples = [
        conversation(
            first_turn(task),
            later=lambda action, task=task: f"<image>Did {action}. Still: {task} Go on!",
        )
        for task in tasks
    ]
    shown = later(read(samples), "open Box", task="open Box now.")
    assert shown == "<image>Did open Box. Still: open Box now. Go on!"


def test_tasks_that_are_told_again_in_a_sentence(read: Reader) -> None:
    samples = [
        conversation(
            first_turn(task),
            later=lambda action, task=task: f"<image>Did {action}. ({task.rstrip('.?')})",
        )
        for task in TASKS
    ]
    assert later(read(samples), "open Box", task="Sit down") == "<image>Did open Box. (Sit down)"


def test_a_task_that_another_begins_with(read: Reader) -> None:
    prompts = read([conversation(f"<image>{task}") for task in ("Open", "Open it", "Open it up")])
    assert first(prompts, "Close") == "<image>Close"


def test_frames_and_tasks_that_share_words(read: Reader) -> None:
    """What some tasks begin or end with stays theirs."""
    tasks = [
        "It is asked: find a Mug",
        "It is asked: take a Pen",
        "Find a Mug. What",
        "Please What will the robot do?",
        "The robot",
    ]
    prompts = read([conversation(first_turn(task)) for task in tasks])
    for task in (*tasks, "Open it"):
        assert first(prompts, task) == first_turn(task)


def test_stops_are_not_doubled(read: Reader) -> None:
    """If all tasks end with a stop, it may be the task's or the frame's."""
    samples = [
        conversation(f"<image>Task: {task}. Go!") for task in ("Find a Mug", "Take it", "Open up")
    ]
    prompts = read(samples)
    assert first(prompts, "Find a Pen.") == "<image>Task: Find a Pen. Go!"
    assert first(prompts, "Find a Pen") == "<image>Task: Find a Pen. Go!"
    assert first(prompts, "Is there a Pen?") == "<image>Task: Is there a Pen? Go!"


def test_a_few_conversations_that_begin_otherwise(read: Reader) -> None:
    tasks = [f"{verb} the {thing}." for verb in ("Find", "Take", "Move") for thing in "ABCDEFGHIJ"]
    samples = [conversation(first_turn(task)) for task in tasks]
    samples[7] = conversation("<image>The robot sees this. It stops.")
    assert first(read(samples), "Open up!") == first_turn("Open up!")


def test_of_several_wordings_it_is_the_most_common(read: Reader) -> None:
    tasks = [f"{verb} the {thing}." for verb in ("Find", "Take", "Move") for thing in "ABCDEFGHIJ"]

    def other(task: str) -> str:
        return f"<image>{task} That is what I want of you, robot, so look at the picture and begin."

    def wordy(task: str) -> str:
        return f"<image>You stand in a room of a house and see this picture. Your job there: {task}"

    samples = [conversation((other if i % 3 else wordy)(task)) for i, task in enumerate(tasks)]
    assert first(read(samples), "Open up!") == other("Open up!")


def test_tasks_of_one_wording_are_no_frame(read: Reader) -> None:
    long = "Take the {}, which must be somewhere in this room, and then bring it over here to me."
    tasks = (*TASKS, *(f"{verb} it." for verb in "ABCDEF"), long.format("Mug"), long.format("Pen"))
    assert first(read([conversation(f"<image>{task}") for task in tasks]), "Go.") == "<image>Go."


@pytest.mark.parametrize(
    "systems", [("", "", "Be good."), ("Be good.", "", "Be good."), ("A", "Be good.", "Be good.")]
)
def test_the_most_common_system_message(read: Reader, systems: Sequence[str]) -> None:
    samples = [
        conversation(first_turn(task), system=system)
        for task, system in zip(TASKS, systems * 2, strict=True)
    ]
    expected = max(systems, key=systems.count)
    assert read(samples).system(decide="tags", sees="pictures") == expected


def test_a_system_message_beside_the_turns(read: Reader) -> None:
    samples = [
        {**in_sharegpt(conversation(first_turn(task), system="")), "system": "Be kind."}
        for task in TASKS
    ]
    assert read(samples).system(decide="tags", sees="pictures") == "Be kind."


ODD_ITEMS: list[object] = [
    None,
    7,
    "text",
    {},
    {"messages": []},
    {"messages": "no list"},
    {"messages": ["no turn"]},
    {"messages": [{"role": "user", "content": "alone"}]},
    {"messages": [{"role": "assistant", "content": "<DecisionMaking>end</DecisionMaking>"}]},
    {"messages": [{"role": ["user"], "content": {}}, {"from": None}]},
    {
        "messages": [
            {"role": "user", "content": "What is 2 + 2?"},
            {"role": "assistant", "content": "4"},
        ]
    },
    {
        "conversations": [
            {"from": "human", "value": "a"},
            {"from": "human", "value": "b"},
            {"from": "gpt", "value": "<DecisionMaking>end</DecisionMaking>"},
        ]
    },
    {**SAMPLES[0], "system": 3, "messages": SAMPLES[0]["messages"][1:]},
]


def test_odd_items_are_passed_over(read: Reader) -> None:
    prompts = read([*ODD_ITEMS[:6], *SAMPLES, *ODD_ITEMS[6:]])
    assert (prompts.samples, prompts.odd) == (len(SAMPLES), len(ODD_ITEMS))
    assert f"{len(ODD_ITEMS)} items skipped" in prompts.about
    assert first(prompts, "Go.") == first_turn("Go.")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"none of 0 items is a conversation"),
        ("[]", r"none of 0 items"),
        (json.dumps(ODD_ITEMS), rf"none of {len(ODD_ITEMS)} items"),
        ("no JSON", r"not JSON after 0 whole items"),
        (json.dumps(SAMPLES)[:-40], r"not JSON after 5 whole items"),
        (json.dumps([SAMPLES[0]] * 4), r"all 4 conversations begin alike"),
        (
            json.dumps(
                [
                    {"messages": conversation(first_turn(task), ["end"])["messages"][:3]}
                    for task in TASKS
                ]
            ),
            r"no conversation goes on after a decision",
        ),
        (
            json.dumps([conversation(first_turn(task), ["sing a song"]) for task in TASKS]),
            r"no conversation goes on after a decision",
        ),
    ],
)
def test_files_that_do_not_serve(read: Reader, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        read.text(text)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(read.file))


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "latin").write_bytes(b'[{"messages": "\xe9"}]')
    for name, problem in (
        ("nowhere", "no such file"),
        ("", "a directory"),
        ("latin", "not UTF-8"),
    ):
        with pytest.raises(ValueError, match=problem):
            load_prompts(Prompts(dataset=str(tmp_path / name)))


@pytest.mark.parametrize(
    ("decide", "sees"), [("tools", "pictures"), ("json", "pictures"), ("tags", "text")]
)
def test_what_such_models_have_not_learnt(read: Reader, decide: Any, sees: Any) -> None:
    with pytest.raises(ValueError, match=r"prompts of train\.json need decide: tags and sees:"):
        read(SAMPLES).system(decide=decide, sees=sees)
