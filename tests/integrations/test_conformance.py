"""Every plug answers as ``gymnasium.make``: the same texts, rewards, successes and ends."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

from conformance import SETTINGS, TASKS, TEXTS, Answer, Course, differences

from er_gym.integrations.session import Session, Turn
from er_gym.tasks.suites import load_suite
from er_gym.tasks.types import TASK_TYPES


def answer(turn: Turn) -> Answer:
    return Answer(turn.text, turn.reward, turn.done, turn.success)


class OfSession:
    def __init__(self) -> None:
        self.session = Session(**SETTINGS)

    def reset(self, task_id: str) -> Answer:
        return answer(self.session.reset(task_id))

    def step(self, text: str) -> Answer:
        return answer(self.session.step(text))


def test_the_courses_are_of_all_types_and_end_in_every_way(courses: tuple[Course, ...]) -> None:
    types = {task.id: task.type.name for task in load_suite(SETTINGS["episode_source"]).tasks}
    assert len({course.task_id for course in courses}) == TASKS
    assert {types[course.task_id] for course in courses} == {row.name for row in TASK_TYPES}
    assert sum(len(course.texts) for course in courses) == TEXTS
    ends = Counter((each.answers[-1].done, each.answers[-1].success) for each in courses)
    assert all(ends[end] >= 3 for end in ((True, True), (True, False), (False, False)))
    most = SETTINGS["max_steps"] - 1  # placing the agent is the first step
    assert sum(len(each.texts) == most and each.answers[-1].done for each in courses) >= 3
    assert sum(each.reward > 0 for course in courses for each in course.answers) >= 20


def test_the_session_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfSession(), courses) == []


def test_a_difference_is_seen(courses: tuple[Course, ...]) -> None:
    class Dishonest(OfSession):
        def step(self, text: str) -> Answer:
            return replace(super().step(text), success=False)

    won = sum(course.answers[-1].success for course in courses)
    assert len(differences(Dishonest(), courses)) == won
