from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest

from er_gym.plugins import PluginError
from er_gym.tasks import paraphrase
from er_gym.tasks.paraphrase import LONGEST, Paraphraser, choose, load_ask, make_prompt, usable

INSTRUCTION = "Put the Book on the Shelf."
NAMES = ("Book", "Shelf")
REPLY = "Please put the Book on the Shelf.\nCould you place the Book on the Shelf?"
LINES = tuple(REPLY.split("\n"))


class Model:
    """Answers always the same, and remembers what it was asked."""

    def __init__(self, reply: str = REPLY) -> None:
        self.reply = reply
        self.prompts: list[str] = []

    def __call__(self, prompt: str) -> str:
        self.prompts.append(prompt)
        return self.reply


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    return tmp_path / "new" / "replies.jsonl"


def test_asks_once_for_an_instruction(cache: Path) -> None:
    model = Model()
    words = Paraphraser(model, cache)
    assert words(INSTRUCTION, NAMES) == LINES
    assert words(INSTRUCTION, ["Shelf", "Book", "Book"]) == LINES
    assert len(model.prompts) == 1
    words("Find the Book.", ["Book"])
    assert len(model.prompts) == 2


def test_asks_once_without_a_file() -> None:
    model = Model()
    words = Paraphraser(model, None)
    assert words(INSTRUCTION, NAMES) == words(INSTRUCTION, NAMES) == LINES
    assert len(model.prompts) == 1


def test_the_prompt_says_what_is_wanted() -> None:
    prompt = make_prompt(INSTRUCTION, NAMES, 7)
    assert INSTRUCTION in prompt
    assert "Write 7 other ways" in prompt
    assert "spelled exactly as they are, capital letters included: Book, Shelf." in prompt
    assert "spelled" not in make_prompt("Look around.", (), 3)


def test_a_later_run_is_served_from_the_file(cache: Path) -> None:
    Paraphraser(Model(), cache)(INSTRUCTION, NAMES)
    later = Model("Never seen.")
    assert Paraphraser(later, cache)(INSTRUCTION, NAMES) == LINES
    assert later.prompts == []
    (line,) = cache.read_text().splitlines()
    assert json.loads(line)["reply"] == REPLY


def test_another_count_or_version_asks_anew(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Paraphraser(Model(), cache)(INSTRUCTION, NAMES)
    model = Model()
    Paraphraser(model, cache, count=5)(INSTRUCTION, NAMES)
    assert len(model.prompts) == 1
    monkeypatch.setattr(paraphrase, "PROMPT_VERSION", paraphrase.PROMPT_VERSION + 1)
    Paraphraser(model, cache)(INSTRUCTION, NAMES)
    assert len(model.prompts) == 2


def test_a_torn_last_line_is_passed_over_and_spoils_nothing(cache: Path) -> None:
    model = Model()
    words = Paraphraser(model, cache)
    words(INSTRUCTION, NAMES)
    words("Find the Book.", ["Book"])
    whole = cache.read_bytes()
    for cut in (1, 10, len(whole.splitlines()[1])):
        cache.write_bytes(whole[:-cut])
        again = Model()
        words = Paraphraser(again, cache)
        words(INSTRUCTION, NAMES)
        words("Find the Book.", ["Book"])
        # With only its newline lost, the line is whole.
        assert len(again.prompts) == (cut > 1)
        third = Model()
        words = Paraphraser(third, cache)
        words("Find the Mug.", ["Mug"])
        words("Find the Book.", ["Book"])
        words(INSTRUCTION, NAMES)
        assert len(third.prompts) == 1


def test_two_at_once_share_a_file_and_the_first_reply_stays(cache: Path) -> None:
    one, two = Paraphraser(Model(), cache), Paraphraser(Model("Set the Book on the Shelf."), cache)
    assert one(INSTRUCTION, NAMES) == LINES
    assert two(INSTRUCTION, NAMES) == ("Set the Book on the Shelf.",)
    assert len(cache.read_text().splitlines()) == 2
    assert Paraphraser(Model(), cache)(INSTRUCTION, NAMES) == LINES


def test_a_file_of_something_else_is_refused(cache: Path) -> None:
    cache.parent.mkdir()
    cache.write_text('{"format": "er-gym/tasks/1", "tasks": 0}\n')
    with pytest.raises(ValueError, match=r"replies\.jsonl: the reply in line 1 lacks field 'key'"):
        Paraphraser(Model(), cache)


def test_what_the_model_raises_comes_through_and_is_not_kept(cache: Path) -> None:
    def broken(prompt: str) -> str:
        raise ConnectionError("no model today")

    with pytest.raises(ConnectionError, match="no model today"):
        Paraphraser(broken, cache)(INSTRUCTION, NAMES)
    assert not cache.exists()
    assert Paraphraser(Model(), cache)(INSTRUCTION, NAMES) == LINES


def test_a_model_that_replies_no_text_is_an_error_and_not_kept(cache: Path) -> None:
    answer: Callable[[str], object] = len
    with pytest.raises(ValueError, match="reply"):
        Paraphraser(answer, cache)(INSTRUCTION, NAMES)  # type: ignore[arg-type]
    assert not cache.exists()


def test_a_name_that_is_not_in_the_instruction_is_an_error() -> None:
    model = Model()
    with pytest.raises(ValueError, match="lacks 'Desk', 'shelf'; give names as they stand in it"):
        Paraphraser(model, None)(INSTRUCTION, ["Book", "shelf", "Desk"])
    assert model.prompts == []


def test_a_count_below_one_is_an_error() -> None:
    with pytest.raises(ValueError, match="count is 0"):
        Paraphraser(Model(), None, count=0)


def test_returns_no_more_than_asked_for() -> None:
    many = "\n".join(f"{word} put the Book on the Shelf." for word in ("Please", "Now", "Just"))
    assert len(Paraphraser(Model(many), None, count=2)(INSTRUCTION, NAMES)) == 2


@pytest.mark.parametrize(
    "line",
    [
        "1. {}",
        "2) {}",
        "(3) {}",
        "10: {}",
        "1.{}",
        "- {}",
        "* {}",
        "• {}",
        "  {}  ",
        '"{}"',
        "“{}”",
        "**{}**",
        '4. "{}"',
        "- **{}**",
    ],
)
def test_numbers_bullets_and_quotes_are_taken_off(line: str) -> None:
    text = "Please put the Book on the Shelf."
    assert usable(line.format(text), INSTRUCTION, NAMES) == (text,)


@pytest.mark.parametrize(
    "line",
    [
        "Please put the book on the Shelf.",
        "Please put the Books on the Shelf.",
        "Please put the NoteBook on the Shelf.",
        "Please put the Book away.",
        "Please take the Book from the Desk and put it on the Shelf.",
        "Please put the Book on the Shelf of the DiningTable.",
        INSTRUCTION,
        "put the Book on the Shelf!",
        "1. Put the  Book on the Shelf.",
        "Here are three ways to put the Book on the Shelf:",
        "please place the Book on the Shelf.",
        "Please place the Book on the Shelf",
        "Please place the {{object}} Book on the Shelf.",
        "Please, " + "please, " * (LONGEST // 8) + "place the Book on the Shelf.",
        "",
    ],
)
def test_lines_of_no_use_are_dropped(line: str) -> None:
    assert usable(f"{line}\n{LINES[0]}\n", INSTRUCTION, NAMES) == LINES[:1]


def test_equal_lines_count_once() -> None:
    reply = f"{LINES[0]}\n\nPlease, put the Book on the Shelf.\n{LINES[1]}"
    assert usable(reply, INSTRUCTION, NAMES) == LINES


def test_names_may_be_words_other_than_types() -> None:
    reply = "Switch off the DeskLamp.\nSwitch on the DeskLamp.\nSwitch the DeskLamp off."
    found = usable(reply, "Turn off the DeskLamp in the living room.", ["DeskLamp", "off"])
    assert found == ("Switch off the DeskLamp.", "Switch the DeskLamp off.")
    assert usable(reply, "Turn off the DeskLamp in the living room.", ["living room"]) == ()


def test_a_choice_depends_on_the_id_alone() -> None:
    variants = ["one", "two", "three"]
    assert choose(variants, "FloorPlan1-single_search-Apple") == "two"
    ids = [f"FloorPlan{number}-single_search-Apple" for number in range(1, 31)]
    assert {choose(variants, task_id) for task_id in ids} == set(variants)
    with pytest.raises(ValueError, match="task T: no wordings to choose from"):
        choose([], "T")


@pytest.fixture
def modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "made_for_paraphrase"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "good.py").write_text("NAME = 'x'\ndef ask(prompt):\n    return prompt.upper()\n")
    (package / "bad.py").write_text("raise RuntimeError('set MODEL_KEY\\nfirst')\n")
    monkeypatch.syspath_prepend(str(tmp_path))


@pytest.mark.usefixtures("modules")
def test_loads_a_function_by_name() -> None:
    assert load_ask("made_for_paraphrase.good:ask")("hello") == "HELLO"


@pytest.mark.usefixtures("modules")
@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("", "unknown paraphraser ''; choose one of: package.module:Name"),
        ("made_for_paraphrase.good", "unknown paraphraser 'made_for_paraphrase.good'"),
        ("made_for_paraphrase.good:", "unknown paraphraser"),
        (":ask", "unknown paraphraser"),
        (".good:ask", "unknown paraphraser"),
        ("a:b:c", "unknown paraphraser"),
        ("made for:ask", "unknown paraphraser"),
        (
            "no_such_module:ask",
            "Cannot import 'no_such_module' of paraphraser 'no_such_",
        ),
        ("made_for_paraphrase.bad:ask", "(RuntimeError: set MODEL_KEY); give a function"),
        ("made_for_paraphrase.good:tell", "'made_for_paraphrase.good' has no 'tell'"),
        ("made_for_paraphrase.good:NAME", "give a function from a prompt to a reply"),
    ],
)
def test_a_wrong_spec_is_answered_in_one_line(spec: str, message: str) -> None:
    with pytest.raises(PluginError) as caught:
        load_ask(spec)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
