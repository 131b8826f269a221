"""ShareGPT files, others' too: read one sample at a time, every problem told before anything."""

from __future__ import annotations

import json
import pickle
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from er_gym.data.json_items import json_items
from er_gym.data.parse_conversation import thoughts_of
from er_gym.data.sharegpt_files import ShareGptError, open_sharegpt
from er_gym.data.sharegpt_import import import_sharegpt
from er_gym.tasks.errors import TaskFileError

END = "Let me double-check: it is in my hand. <DecisionMaking>end</DecisionMaking>"
PICTURES = "./data/images/single_pickup/FloorPlan203_single_pickup_7_b"
FIRST = (
    'You are free to think. Task: "Pick up the CreditCard." <image>Available_Actions: {"navigate '
    'to <object>": "go"}'
)


def papers() -> dict[str, Any]:
    """A sample as the paper's file has them, worded anew."""
    return {
        "messages": [
            {"role": "system", "content": "You are a robot in a room."},
            {"role": "user", "content": FIRST},
            {
                "role": "assistant",
                "content": "Let me observe the room: a sofa and a shelf. Hang on, cards lie on "
                "shelves. Hmm, or on the sofa. Let me create a plan first: the shelf. Okay, I've "
                "decided.<DecisionMaking>navigate to Shelf</DecisionMaking>",
            },
            {"role": "user", "content": "<|feedback|>After your navigate to Shelf, nothing moved."},
            {
                "role": "assistant",
                "content": "Hold on, I need to rethink this.\n"
                "<DecisionMaking>pickup CreditCard</DecisionMaking>",
            },
            {"role": "user", "content": "<image>After your pickup, this is what you see."},
            {"role": "assistant", "content": END},
        ],
        "images": [f"{PICTURES}/{number}.png" for number in (0, 2)],
    }


def older(text: str = END) -> dict[str, Any]:
    return {
        "conversations": [
            {"from": "human", "value": "<image>Look."},
            {"from": "gpt", "value": text},
        ],
        "images": ["a.png"],
    }


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for path in [*papers()["images"], "a.png"]:
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGB", (32, 18)).save(tmp_path / path)
    return tmp_path


def written(path: Path, samples: object) -> Path:
    path.write_text(json.dumps(samples, indent=1), encoding="utf-8")
    return path


def test_the_papers_layout_becomes_conversations_and_trajectories(folder: Path) -> None:
    (folder / "sub").mkdir()
    plain = papers()
    del plain["messages"][3:5]
    file = open_sharegpt(written(folder / "sub" / "train.json", [papers(), plain]), decisions=True)
    assert file.folder == folder  # the pictures lie beside the file's folder
    assert file.report.with_feedback == 1
    assert file.report.lines()[0].endswith(
        "train.json: 2 samples, 5 replies, 4 pictures; samples with <|feedback|>: 1"
    )
    chat = pickle.loads(pickle.dumps(file))[0]
    assert [turn.text for turn in chat.turns] == [m["content"] for m in papers()["messages"]]
    assert [picture.width for picture in chat.pictures] == [32, 32]
    assert chat.trains_all
    assert len(open_sharegpt(file.path, feedback=True)) == 1

    import_sharegpt(file, folder / "y")
    found = [json.loads(x) for x in (folder / "y" / "trajectories.jsonl").read_text().splitlines()]
    first = found[0]
    assert first["instruction"] == "Pick up the CreditCard."
    assert (first["scene"], first["task_type"], first["kind"]) == (
        "FloorPlan203",
        "single_pickup",
        "b",
    )
    assert [turn["part"] for turn in found] == ["feedback", "plain"]
    assert first["key_actions"] == []
    assert [(turn["verb"], turn["object_type"], turn["success"]) for turn in first["turns"]] == [
        ("navigate to", "Shelf", False),
        ("pickup", "CreditCard", True),
        ("end", "", True),
    ]
    assert first["turns"][0]["feedback"] == "After your navigate to Shelf, nothing moved."
    thoughts = [[(each["kind"], each["text"]) for each in x["thoughts"]] for x in first["turns"]]
    assert thoughts == [
        [
            ("analysis", "Let me observe the room: a sofa and a shelf."),
            ("reasoning", "Hang on, cards lie on shelves."),
            ("reasoning", "Hmm, or on the sofa."),
            ("planning", "Let me create a plan first: the shelf."),
        ],
        [("reflection", "Hold on, I need to rethink this.")],
        [("verification", "Let me double-check: it is in my hand.")],
    ]
    picture = folder / "y" / first["turns"][2]["pictures"][0]["path"]
    assert picture.is_file()


def test_words_without_an_opener_are_kept() -> None:
    said = "It is dark. Hang on, a lamp! <DecisionMaking>toggle FloorLamp</DecisionMaking>"
    found = [(each.kind, each.text) for each in thoughts_of(said, "en", first=True)]
    assert found == [("analysis", "It is dark."), ("reasoning", "Hang on, a lamp!")]
    assert thoughts_of("<DecisionMaking>end</DecisionMaking>", "en", first=False) == []


def test_columns_of_others(folder: Path) -> None:
    lines = "\n".join(json.dumps(older()) for _ in range(3))
    (folder / "old.jsonl").write_text(lines)
    assert len(open_sharegpt(folder / "old.jsonl")) == 3
    renamed = {"talk": older()["conversations"], "shots": ["a.png"]}
    written(folder / "mine.json", [renamed])
    with pytest.raises(ShareGptError, match="its first item has: talk, shots; put a dataset_info"):
        open_sharegpt(folder / "mine.json")
    columns = {"messages": "talk", "images": "shots"}
    entry = {"file_name": "mine.json", "formatting": "sharegpt", "columns": columns}
    written(folder / "dataset_info.json", {"mine": entry, "other": {"file_name": "x.json"}})
    for path, name in ((folder / "mine.json", ""), (folder, "mine")):
        (chat,) = open_sharegpt(path, dataset=name)
        assert [turn.role for turn in chat.turns] == ["user", "assistant"]
    with pytest.raises(ShareGptError, match="has the datasets mine, other; name one of them"):
        open_sharegpt(folder)
    with pytest.raises(ShareGptError, match="has the formatting 'alpaca'"):
        open_sharegpt(folder, dataset="other")


def test_every_problem_is_told_before_anything_is_used(folder: Path) -> None:
    bad: list[Any] = [older() for _ in range(8)]
    bad[1]["images"] = []
    bad[2]["images"] = ["gone.png"]
    bad[3]["conversations"].append({"from": "gpt", "value": END})
    bad[4] = older(" ")
    bad[5]["conversations"][0]["from"] = "robot"
    bad[6] = older("Done.")
    bad[7]["conversations"].pop()
    file = written(folder / "bad.json", bad)
    with pytest.raises(ShareGptError, match=r"\A[^\n]+\Z") as error:
        open_sharegpt(file)
    told = str(error.value)
    for words in (
        "of 8 samples, 1 are laid out otherwise (first: item 5 (line",
        "message 0 has the unknown from 'robot')",
        "2 do not alternate between user and assistant (first: item 3",
        "1 have an empty reply",
        "1 have another number of <image> than of pictures (first: item 1",
        "1 places, 0 pictures",
        "1 name a picture that is not there",
    ):
        assert words in told
    kept = open_sharegpt(file, leave_out=True)
    assert [chat.turns[1].text for chat in kept] == [END, "Done."]
    assert kept.report.counts["no decision"] == 1
    assert len(open_sharegpt(file, leave_out=True, decisions=True)) == 1
    with pytest.raises(ShareGptError, match="none of the 8 samples is left with"):
        open_sharegpt(file, leave_out=True, feedback=True)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the file is empty"),
        ("[]", "no items"),
        ('[{"a": 1}, {"b": ', "ends in the middle of item 1; was it cut off"),
        ('[{"a": 1}', "the list has no end after item 0"),
        ('[{"a": 1}, x]', "line 1: expected an object or the end, found 'x]'"),
        ('[{"a": 1}, nullnull]', "line 1: expected an object or the end, found 'nullnull]'"),
        ('[null, {"a": 1}', "the list has no end after item 1"),
        ("PAR1", "Parquet; write it as JSON Lines first, with pandas"),
        ("PK\x03\x04", "a zip file; unpack it first"),
        ('{"a": 1}\nx', "line 2: expected an object or the end"),
        ('[{"a": "b', "a string without an end"),
    ],
)
def test_damaged_files(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "x.json"
    file.write_text(text)
    with pytest.raises(TaskFileError, match=words.replace("[", r"\[")):
        json_items(file)


def test_the_line_of_an_item_counts_every_line_before_it(tmp_path: Path) -> None:
    file = tmp_path / "lines.json"
    file.write_text('\n{"a": 1}\n\n{"b": 2}', encoding="utf-8")
    items = json_items(file)
    assert [items.line(index) for index in range(len(items))] == [2, 4]


def test_other_values_are_items_too(tmp_path: Path) -> None:
    values = [None, {"a": 1}, 7, "x]", [1, [2]], True, -1.5e3, {"b": [None]}, None]
    for text in (json.dumps(values), "\n".join(map(json.dumps, values[1:]))):
        file = tmp_path / "x.json"
        file.write_text(text)
        items = json_items(file)
        assert [items[index] for index in range(len(items))] == values[-len(items) :]


def test_items_hold_brackets_and_quotes_in_strings(tmp_path: Path) -> None:
    values = [{"a": 'b]}"{\\'}, {"c": [{"d": "é\n"}]}]
    for number, text in enumerate(
        (json.dumps(values), "\ufeff" + "\n".join(map(json.dumps, values)), " {'a': 1}")
    ):
        file = tmp_path / f"{number}.json"
        file.write_text(text, encoding="utf-8")
        if number < 2:
            items = json_items(file)
            assert [items[index] for index in range(len(items))] == values
        else:
            with pytest.raises(TaskFileError, match=r"item 0 \(line 1\): not JSON"):
                json_items(file)[0]
