"""Plays courses of the expert's package without pictures, and notes what they intend."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from agents.expert.acceptance import PlayedCourse, rejection
from agents.expert.candidates import Candidate, CandidateSequence
from agents.expert.course import Course, Intent, View
from agents.expert.prescreen import SilentAgent
from agents.expert.recipe import Part
from agents.expert.thought_kinds import load_thought_kinds
from er_gym.data.remembered import SEARCHING
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

SUITE = load_suite("mini")
TASKS = SUITE.tasks
KINDS = load_thought_kinds()
SEED = 7
MOST = 40


class NotedCourse:
    """A course whose intents are noted, each with what the agent saw when it had it."""

    def __init__(self, course: Course) -> None:
        self._course = course
        self.noted: list[tuple[Intent, View]] = []

    @property
    def view(self) -> View:
        return self._course.view

    @view.setter
    def view(self, view: View) -> None:
        self._course.view = view

    def intents(self) -> Iterator[Intent]:
        for intent in self._course.intents():
            self.noted.append((intent, self._course.view))
            yield intent


@dataclass(frozen=True)
class Played:
    """An episode, and what was intended at each of its steps."""

    candidate: Candidate
    episode: EpisodeRecord
    noted: Sequence[tuple[Intent, View]]
    faults: Sequence[str] = field(default=())

    @property
    def task(self) -> Task:
        return self.candidate.task

    @property
    def intents(self) -> list[Intent]:
        return [intent for intent, _ in self.noted]

    @property
    def course(self) -> PlayedCourse:
        candidate = self.candidate
        return PlayedCourse.of_episode(self.episode, candidate.kind, candidate.mode)

    @property
    def problem(self) -> str:
        """Why it would not be taken."""
        return rejection(self.course, MOST)


def searched_though_seen(played: Played) -> list[str]:
    """The learnt decisions to search for something that is or was in view."""
    seen: set[str] = set()
    found = []
    for intent, view in played.noted:
        around = view.info["object_views_around"].values()
        views = (*view.info["object_views"], *(each for way in around for each in way))
        seen.update(each.object_type for each in views)
        goal = intent.subgoal
        sought = goal.place if goal.thing == view.held else goal.thing
        searches = intent.train and intent.purpose in SEARCHING
        if searches and any(same_type(sought, each) for each in seen):
            found.append(f"{played.candidate.id}: {intent.action} for {sought}")
    return found


def environment(**more: object) -> EmbodiedEnv:
    """The suite's environment, without pictures."""
    return EmbodiedEnv((), **{**SUITE.env, "obs_mode": SilentAgent.obs_mode, **more})


def play(env: EmbodiedEnv, candidate: Candidate) -> Played:
    """Play a candidate as a prescreening does."""
    seed = episode_seed(SEED, candidate.id)
    course = NotedCourse(candidate.course(seed, KINDS))
    episode = play_episode(env, SilentAgent(course), candidate.played_task, seed)
    assert not episode.error, episode.error
    faults = [str(view.info["fault"]) for _, view in course.noted[1:]]
    return Played(candidate, episode, course.noted, [*faults, ""])


def of_each_type(part: Part, number: int, name: str = "part") -> Iterator[Candidate]:
    """The first candidates of each task type that a part has."""
    for kind in part.types:
        tasks = [task for task in TASKS if task.type.name == kind]
        sequence = CandidateSequence(name, part, tasks, SEED)
        yield from (sequence[index] for index in range(number))
