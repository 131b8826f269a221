"""Prompts: those that come with er-gym, and those that users write."""

from __future__ import annotations

import itertools
import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from support import in_one_test

from agents.vlm.chat import Picture
from agents.vlm.prompt_set import (
    IMAGE_MARK,
    THOUGHTS,
    Decide,
    LastAction,
    PromptSet,
    Sees,
    TurnContext,
    interleave_pictures,
)
from agents.vlm.prompts import load_prompts
from agents.vlm.settings import Prompts
from agents.vlm.templates import _meaning
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.verbs import Verb, Words

BUNDLED = [
    {"profile": file.parents[1].name, "language": file.parent.name}
    for file in sorted(config_directory("prompts").glob("*/*/system.jinja"))
]
WAYS: list[tuple[Decide, Sees]] = list(
    itertools.product(("tags", "tools", "json"), ("pictures", "text"))
)
ALL_VERBS = (*verbs.OBJECT_VERBS, *verbs.BARE_VERBS)
TASK = "Please find the Mug in this kitchen."
ONE, TWO = (Picture(name, "image/png", 1, 1) for name in (b"one", b"two"))


@pytest.fixture(params=BUNDLED, ids=lambda where: "-".join(where.values()))
def prompts(request: pytest.FixtureRequest) -> PromptSet:
    return load_prompts(Prompts.model_validate(request.param))


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    """A copy of the default profile, to be changed."""
    copy = tmp_path / "mine"
    shutil.copytree(config_directory("prompts") / "default", copy)
    return copy


def written(profile: Path, template: str, text: str) -> PromptSet:
    """The profile with a template of these words."""
    (profile / "en" / template).write_text(text, encoding="utf-8")
    return load_prompts(Prompts(profile=str(profile)))


def said(prompts: PromptSet, decide: Decide, sees: Sees) -> list[str]:
    """Everything that a set says."""
    scene, pictures = ("You see: Fridge.", 0) if sees == "text" else ("", 1)
    turn = TurnContext(task=TASK, decide=decide, sees=sees, scene_text=scene, steps=1, max_steps=30)
    first = prompts.first(turn)
    turns = [
        prompts.next(
            replace(turn, steps=7, max_steps=max_steps),
            LastAction(
                action=action,
                success=success,
                feedback="You cannot.",
                pictures=4 if pictures and action == verbs.OBSERVE else pictures,
            ),
        )
        for action in ("navigate to Fridge", verbs.OBSERVE)
        for success in (True, False)
        for max_steps in (0, 30)
    ]
    system = prompts.system(decide=decide, sees=sees)
    return [system, first, *turns, prompts.feedback(problem="It is empty.", decide=decide)]


# -- what comes with er-gym ----------------------------------------------------------------------


@pytest.mark.parametrize(("decide", "sees"), WAYS)
def test_everything_can_be_said(prompts: PromptSet, decide: Decide, sees: Sees) -> None:
    texts = said(prompts, decide, sees)
    marks = [text.count(IMAGE_MARK) for text in texts]
    assert marks == [0, 1, 1, 1, 1, 1, 4, 4, 4, 4, 0] if sees == "pictures" else not any(marks)
    for text in texts:
        assert text == text.strip()
        assert text
        assert not re.search(r"\n\n\n|\{\{|\{%|<image>| $", text, re.MULTILINE)


@pytest.mark.parametrize(("decide", "sees"), WAYS)
def test_the_same_words_every_time(prompts: PromptSet, decide: Decide, sees: Sees) -> None:
    again = load_prompts(
        Prompts.model_validate(
            dict(zip(("profile", "language"), prompts.name.split("/"), strict=1))
        )
    )
    assert again.digest == prompts.digest
    assert said(again, decide, sees) == said(prompts, decide, sees)


def test_how_to_reply(prompts: PromptSet) -> None:
    systems = {way: prompts.system(decide=way[0], sees=way[1]) for way in WAYS}
    assert len({*systems.values()}) == len(WAYS)
    example = "<DecisionMaking>navigate to Fridge</DecisionMaking>"
    for (decide, _), text in systems.items():
        assert all(thought in text for thought in THOUGHTS)
        assert (example in text) == (decide == "tags")
        assert ('"object": "Fridge"' in text) == (decide == "json")
        asked_again = prompts.feedback(problem="It is empty.", decide=decide)
        assert "It is empty." in asked_again
        assert (example in asked_again) == (decide == "tags")


def test_every_action_is_explained(prompts: PromptSet) -> None:
    text = prompts.first(TurnContext(task=TASK, decide="tags", sees="pictures"))
    lines = text.splitlines()
    for verb in ALL_VERBS:
        form = f"- {verb} <object>" if verb in verbs.OBJECT_VERBS else f"- {verb}"
        assert sum(bool(re.match(re.escape(form) + "[:：]", line)) for line in lines) == 1
    assert TASK in text


def test_what_came_of_an_action(prompts: PromptSet) -> None:
    def turn(success: bool) -> str:
        turn = TurnContext(task=TASK, decide="tags", sees="pictures", steps=7, max_steps=30)
        feedback = "It is open already."
        return prompts.next(
            turn, LastAction(action="open Fridge", success=success, feedback=feedback, pictures=1)
        )

    for success in (True, False):
        text = turn(success)
        assert "open Fridge" in text
        assert "23" in text
        assert ("It is open already." in text) == (not success)


def test_words_instead_of_pictures(prompts: PromptSet) -> None:
    scene = "Step 3 of 9.\nYou see: Fridge."
    turn = TurnContext(task=TASK, decide="tags", sees="text", scene_text=scene)
    first, later = prompts.first(turn), prompts.next(turn, LastAction(action="open Fridge"))
    assert scene in first
    assert scene in later


def test_no_list_of_types_is_given_away(prompts: PromptSet) -> None:
    """A model with vision must find the objects itself, so its prompts list no object types."""
    text = "\n".join(said(prompts, "tags", "pictures"))
    for name in ("Mug", "Drawer", "Cabinet", "Sofa", "Bed", "Desk"):
        assert name not in text.replace(TASK, "")


def test_languages_have_the_same_files() -> None:
    for profile in {where["profile"] for where in BUNDLED}:
        root = config_directory("prompts") / profile
        files = {
            folder.name: {file.name for file in folder.iterdir()}
            for folder in root.iterdir()
            if folder.is_dir()
        }
        assert {"en", "zh"} <= files.keys()
        assert len({frozenset(names) for names in files.values()}) == 1


def test_the_variables_that_are_documented_exist(mine: Path) -> None:
    readme = (config_directory("prompts") / "README.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`[\w`, ]+`) \| (all(?: but `feedback`)?|[\w`, ]+) \|", readme, re.M)
    templates = ("system", "first", "next", "feedback")
    documented = {
        (name, template)
        for names, where in rows
        for template in templates
        if template in where or (where.startswith("all") and template not in where)
        for name in re.findall(r"\w+", names)
        if not (where.startswith("all but") and template == "feedback")
    }
    assert len({name for name, _ in documented}) >= 12
    for template in templates:
        names = sorted(name for name, where in documented if where == template)
        marks = "{% for _ in range(pictures) %}<image>{% endfor %}" if "pictures" in names else ""
        text = "".join(f"{{{{ {name} }}}}" for name in names)
        written(mine, f"{template}.jinja", text + marks)


# -- pictures in text ----------------------------------------------------------------------------


def test_pictures_take_the_places_of_marks() -> None:
    assert interleave_pictures(f"a {IMAGE_MARK} b {IMAGE_MARK}", [ONE, TWO]) == (
        "a ",
        ONE,
        " b ",
        TWO,
    )
    assert interleave_pictures(f"{IMAGE_MARK}{IMAGE_MARK}\nb", [ONE, TWO]) == (ONE, TWO, "\nb")
    assert interleave_pictures("no picture", []) == ("no picture",)
    assert interleave_pictures("", []) == ()


@pytest.mark.parametrize(("text", "pictures"), [(IMAGE_MARK, 0), (IMAGE_MARK, 2), ("", 1)])
def test_marks_without_pictures(text: str, pictures: int) -> None:
    with pytest.raises(ValueError, match=rf"has {len(text)} places for {pictures} pictures"):
        interleave_pictures(text, [ONE] * pictures)


@pytest.mark.parametrize(
    "odd", ["<image>", IMAGE_MARK, "{{ task }}", "{% for %}", "<image><image>"]
)
def test_a_task_may_say_anything(prompts: PromptSet, odd: str) -> None:
    task = f"Find the {odd} Mug."
    turn = TurnContext(task=task, decide="tags", sees="pictures")
    for text in (prompts.first(turn), prompts.next(turn, LastAction(action="end", pictures=1))):
        parts = interleave_pictures(text, [ONE])
        assert parts.count(ONE) == 1
        assert f"Find the {odd.replace(IMAGE_MARK, '')} Mug." in "".join(
            part for part in parts if isinstance(part, str)
        )


# -- what others write ---------------------------------------------------------------------------


def test_a_profile_of_ones_own(mine: Path) -> None:
    prompts = written(mine, "system.jinja", "Beep, said {{ thoughts[0] }}.")
    assert prompts.system(decide="tags", sees="pictures") == "Beep, said Observation."
    assert prompts.name == "mine/en"


@pytest.mark.parametrize(
    "file", ["system.jinja", "first.jinja", "next.jinja", "views.jinja", "actions.yaml"]
)
def test_the_digest_is_of_all_words(mine: Path, file: str) -> None:
    before = load_prompts(Prompts(profile=str(mine))).digest
    assert before == load_prompts(Prompts()).digest
    path = mine / "en" / file
    path.write_text(path.read_text(encoding="utf-8").replace(".", ";", 1), encoding="utf-8")
    after = load_prompts(Prompts(profile=str(mine))).digest
    assert after != before
    assert re.fullmatch(r"[0-9a-f]{64}", after)


def test_languages_have_digests_of_their_own() -> None:
    assert load_prompts(Prompts()).digest != load_prompts(Prompts(language="zh")).digest


def test_what_is_changed_while_it_is_used_changes_nothing(mine: Path) -> None:
    prompts = load_prompts(Prompts(profile=str(mine)))
    before = said(prompts, "tags", "pictures")
    for file in (mine / "en").iterdir():
        file.write_text("Other words", encoding="utf-8")
    assert said(prompts, "tags", "pictures") == before


@pytest.mark.parametrize(
    ("template", "text", "message"),
    [
        ("system.jinja", "a\n{{ taks }}", r"system\.jinja:2: UndefinedError: 'taks' is undefined"),
        ("next.jinja", "<image>{{ problem }}", r"next\.jinja:1: UndefinedError"),
        ("system.jinja", "{{ ''.__class__ }}", r"system\.jinja:1: SecurityError"),
        (
            "system.jinja",
            "{{ ''['__class__']['__mro__'][1]['__subclasses__']() }}",
            r"system\.jinja:1: SecurityError",
        ),
        ("system.jinja", "{{ self.__init__.__globals__ }}", r"system\.jinja:1: SecurityError"),
        ("system.jinja", "{{ range(10 ** 9)|list }}", r"system\.jinja:1: SecurityError"),
        ("system.jinja", "\n\n{% if %}", r"jinja:3: not a valid template: Expected an expression"),
        ("system.jinja", "{% include '../../x.jinja' %}", r"system\.jinja:1: TemplateNotFound"),
        ("views.jinja", "\n{{ nothing }}", r"views\.jinja:2: UndefinedError"),
        ("feedback.jinja", "{{ problem }}<image>", r"<image> occurs 1 times, .* is 0"),
        ("first.jinja", "No picture.", r"first\.jinja: <image> occurs 0 times, .* is 1"),
        ("views.jinja", "<image>", r"next\.jinja: <image> occurs 1 times, .* is 4"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_template_is_one_line(
    mine: Path, template: str, text: str, message: str
) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        written(mine, template, text)
    assert "\n" not in str(caught.value)
    assert str(mine) in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "observe: look",
            "give the meanings of these actions, and of no others: navigate to, pickup,",
        ),
        ("- observe", "give the meanings of these actions"),
        ("a: [", "not YAML"),
        ("\n".join(f"{verb}: do" for verb in (*ALL_VERBS, "fly")), "and of no others"),
    ],
)
def test_actions_that_do_not_fit(mine: Path, text: str, message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        written(mine, "actions.yaml", text)
    assert "\n" not in str(caught.value)


@in_one_test(
    "row",
    [  # the languages that have words, and what the prompts say in English and in Chinese
        ({"en": "Rub it clean.", "zh": "把它擦干净。"}, "Rub it clean.", "把它擦干净。"),
        ({"en": "Rub it clean."}, "Rub it clean.", "Rub it clean."),
        ({"zh": "把它擦干净。"}, "clean an object.", "把它擦干净。"),
        ({"en": "Rub it clean.", "zh": ""}, "Rub it clean.", "Rub it clean."),
        ({"en": "", "zh": "把它擦干净。"}, "clean an object.", "把它擦干净。"),
        ({"fr": "Le nettoyer."}, "clean an object.", "clean an object."),
        ({}, "clean an object.", "clean an object."),
    ],
)
def test_an_added_verb_is_explained_in_the_prompts_language_or_in_english(
    row: tuple[dict[str, str], str, str],
) -> None:
    stated, *expected = row
    words = {language: Words(meaning=meaning) for language, meaning in stated.items()}
    verb = Verb(name="clean", object_property="dirtyable", words=words)
    assert [_meaning(verb, language) for language in ("en", "zh")] == expected
    alone = Verb(name="wait", alone=True, words=words)
    assert [_meaning(alone, language) for language in ("en", "zh")] == [
        each.replace("clean an object", "wait") for each in expected
    ]


def test_a_template_that_is_missing(mine: Path) -> None:
    (mine / "en" / "next.jinja").unlink()
    with pytest.raises(ValueError, match=r"lacks next\.jinja; copy it"):
        load_prompts(Prompts(profile=str(mine)))


def test_a_profile_that_is_not_there(tmp_path: Path) -> None:
    for profile in ("nowhere", str(tmp_path), ""):
        with pytest.raises(ValueError, match=r"no prompts .*or one of: default") as caught:
            load_prompts(Prompts(profile=profile))
        assert "\n" not in str(caught.value)


def test_without_jinja(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "jinja2", None)
    with pytest.raises(ValueError, match=r"needs jinja2, .*: pip install 'er-gym\[vlm\]'"):
        load_prompts(Prompts())


def test_a_language_that_is_not_there(mine: Path) -> None:
    shutil.rmtree(mine / "zh")
    with pytest.raises(ValueError, match="do not exist in 'zh'; choose one of: en"):
        load_prompts(Prompts(profile=str(mine), language="zh"))
