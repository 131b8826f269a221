"""Seen and unseen wordings, in English and Chinese, and how they are read."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from dataclasses import replace

import pytest

from agents.rl.subtasks import subtasks
from er_gym.data.mentions import find_mentions
from er_gym.envs.asked_goal import GOAL_VERBS, goal
from er_gym.tasks import Task, load_suite
from er_gym.tasks.splits import (
    STRICT_SCENES,
    STRICTLY_UNSEEN_TYPES,
    TRAINING_SCENES,
    UNSEEN_TYPES,
    subject_types,
    wording,
)
from er_gym.tasks.suites import comes_with_er_gym, own_tasks
from er_gym.tasks.wordings.chinese import CHINESE
from er_gym.tasks.wordings.english import ENGLISH
from er_gym.tasks.wordings.instructions import (
    LANGUAGES,
    Language,
    half_unseen,
    instruction,
    wording_of,
)
from er_gym.tasks.wordings.names import SYNONYMS, chinese_names, types_by_name
from er_gym.tasks.wordings.told import IN_ORDER, told_by
from er_gym.thor import OBJECT_TYPES

GRAMMARS = {"en": ENGLISH, "zh": CHINESE}
_EVERY = 24
"""Of the tasks of er-1k, one in so many is told in other words."""


def told(language: Language) -> Iterator[tuple[Task, str, str]]:
    """Tasks with instructions in both wordings: the task, the wording and the instruction."""
    for task in own_tasks("er-1k")[::_EVERY]:
        for kept in ("seen", "unseen"):
            for number in range(3):
                said = instruction(task.name, f"{task.id}-{number}", task.scene, kept, language)
                assert said is not None
                yield task, kept, said


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_is_said_in_other_words_is_read_as_the_same(language: Language) -> None:
    for task, kept, said in told(language):
        assert wording_of(task.name, said) == kept
        assert dict(goal(said)[1]) == dict(goal(task.name)[1]) or said.startswith("Before"), said
        wanted, found = subtasks(task.name), subtasks(said)
        # Only where a thing is may be left out, and only in a long-range task.
        assert [replace(each, source="") for each in found] == [
            replace(each, source="") for each in wanted
        ], said


@pytest.mark.parametrize("language", LANGUAGES)
def test_there_are_hundreds_of_wordings_and_a_fifth_of_the_parts_is_kept_back(
    language: Language,
) -> None:
    grammar = GRAMMARS[language]
    for wordings in grammar.templates.values():
        assert len(set(wordings.all)) == len(wordings.all) >= 160
    assert len(set(grammar.orders.all)) == len(grammar.orders.all) >= 100
    sentences = grammar.sentences.values()
    for parts in (grammar.frames, *(each.cores for each in sentences)):
        assert 0.14 <= len(parts.unseen) / len(parts.all) <= 0.26


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_frame_asks_for_nothing_by_itself(language: Language) -> None:
    for frame in GRAMMARS[language].frames.all:
        alone = frame.replace("{core}", "")
        assert frame.count("{core}") == 1
        assert not any(goal(alone)[0]), frame
        assert not goal(alone)[1]
        assert not list(find_mentions(alone)), frame


def test_a_single_task_says_nothing_of_an_order_in_chinese() -> None:
    then = list(GOAL_VERBS).index("then")
    for kind, sentences in CHINESE.sentences.items():
        for core in sentences.cores.all:
            plain = re.sub(r"\{\w+\}", "", core)
            assert bool(goal(plain)[0][then]) == (kind == "move two"), core


def test_a_name_stands_for_one_type() -> None:
    for table in (SYNONYMS, chinese_names()):
        for kind, parts in table.items():
            assert kind in OBJECT_TYPES
            for name in parts.all:
                assert types_by_name()[name.lower()] == kind
    every = [name.lower() for parts in SYNONYMS.values() for name in parts.all]
    assert len(every) == len(set(every))
    for kind, parts in SYNONYMS.items():
        for name in parts.all:
            assert goal(f"Find the {name}.")[1] == ((kind, 1.0),)


def test_half_of_an_evaluation_suite_is_told_in_unseen_wordings() -> None:
    for name in ("mini", "er-val", "houses-1k"):
        tasks = own_tasks(name)
        share = sum(wording(task) == "unseen" for task in tasks) / len(tasks)
        assert 0.48 <= share <= 0.5
        assert half_unseen(tasks) == tasks


def test_train_is_told_in_seen_wordings_alone_and_has_no_unseen_instruction() -> None:
    train = {task.instruction for task in own_tasks("train")}
    assert {wording(task) for task in own_tasks("train")[::40]} == {"seen"}
    tasks = own_tasks("er-1k")
    alike = [task for task in tasks if task.instruction in train]
    assert len(alike) <= 0.03 * len(tasks)
    assert all(wording(task) == "seen" for task in alike)


def test_a_suite_in_chinese_is_the_same_but_for_its_instructions() -> None:
    english, chinese = load_suite("mini"), load_suite("mini", language="zh")
    assert (chinese.name, load_suite("mini-zh")) == ("mini-zh", chinese)
    assert chinese.digest != english.digest
    assert comes_with_er_gym(chinese)
    for one, other in zip(english.tasks, chinese.tasks, strict=True):
        assert replace(other, instruction=one.instruction) == one
        assert re.search(r"[\u4e00-\u9fff]", other.instruction)
        assert wording(other) == wording(one)
    assert load_suite("mini", language="en") == english


def test_what_er_gym_did_not_name_is_in_no_wording_and_not_told_in_another() -> None:
    assert told_by("Bring me the paper!") is None
    assert wording_of("Bring me the paper!", "Bring me the paper!") is None
    assert instruction("Bring me the paper!", "x", "FloorPlan1", "seen", "zh") is None
    name = "First, polish the Apple. Then, put the Apple in the Fridge."
    assert instruction(name, "x", "FloorPlan1") is not None
    assert instruction(name, "x", "FloorPlan1", "seen", "zh") is None
    other = "Find the Apple in the kitchen."
    assert wording_of(other, "Locate, o friend, the Apple!") is None
    assert wording_of(other, "Please find the Egg in the kitchen.") is None


def test_kinds_are_told_apart_by_the_first_sentence() -> None:
    kinds = {told_by(task.name) for task in own_tasks("mini")}
    assert {each.kind for each in kinds if each} == {*ENGLISH.sentences, IN_ORDER}


def test_strictly_unseen_types_stand_in_no_strict_room(scene_objects) -> None:
    assert STRICTLY_UNSEEN_TYPES < UNSEEN_TYPES
    assert set(STRICT_SCENES) < set(TRAINING_SCENES)
    rng = random.Random(0)
    for scene in rng.sample(STRICT_SCENES, 6):
        kinds = {each["objectType"] for each in scene_objects(scene)}
        assert not kinds & STRICTLY_UNSEEN_TYPES
    about = [t for t in own_tasks("er-1k") if subject_types(t) & STRICTLY_UNSEEN_TYPES]
    assert len(about) == 62
