"""Episodes of earlier runs, played again as they were, and recorded as trajectories."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

from agents.expert.acceptance import steps_of
from agents.expert.candidates import Candidate
from agents.expert.course import Intent, View
from agents.expert.legs import legs_of
from agents.expert.players import PlaySettings, header_of
from agents.expert.recorded_replies import RecordedReplies, recorded_replies
from agents.expert.recorder import (
    FOLDERS,
    OBS_MODE,
    TrajectoryHeader,
    TrajectoryRecorder,
    thoughts_text,
)
from agents.expert.replayed_intents import replayed_intent
from agents.expert.thinker import ThinkingAgent
from agents.expert.writers.base import ThoughtWriter
from er_gym.data.trajectory import Subgoal, Trajectory
from er_gym.envs.actions import Action
from er_gym.envs.feedback import as_now
from er_gym.rollout.agent import Agent, Decision, MakeAgent
from er_gym.rollout.records import EpisodeRecord, StepRecord
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

PLAYED = "played"
"""The kind of a trajectory that was played before by some agent."""
DIFFERS = "its replay came out differently"
CRITIC = "the critic refuses a thought"


class ReplayedCourse:
    """Does the actions of an episode again; :class:`~agents.expert.course.Course`.

    The reason for an action was not recorded; it is inferred from the task and the held object. A
    turn whose action failed is not to be learnt from.

    Args:
        task: the task.
        steps: of the episode, without the first, which placed the agent.
    """

    view: View

    def __init__(self, task: Task, steps: Sequence[StepRecord]) -> None:
        self._legs, self._steps = legs_of(task), steps

    def intents(self) -> Iterator[Intent]:
        """The decisions; after the last of the episode ``end``, if the replay is not over then."""
        failed: Action | None = None
        for step in self._steps:
            action = Action(step.verb, step.object_type)
            yield replayed_intent(
                action, self.view, self._legs, train=step.success, again=action == failed
            )
            failed = None if step.success else action
        while True:
            yield Intent(Action(verbs.END), "finish", Subgoal(), train=False)


class QuotingAgent:
    """Repeats the actions of an episode's agent, and records its own thoughts.

    The critic checks the thoughts; its objections are recorded and change nothing.

    Args:
        course: decides.
        words: one for each step.
        name: of the agent.
        header: what the trajectory says of itself.
        settings: of the collection.
        rejects: see :class:`~agents.expert.recorder.TrajectoryRecorder`.
    """

    obs_mode = OBS_MODE
    attachment_folders = FOLDERS

    def __init__(
        self,
        course: ReplayedCourse,
        words: RecordedReplies,
        name: str,
        header: TrajectoryHeader,
        settings: PlaySettings,
        rejects: Callable[[Trajectory], str],
    ) -> None:
        self._course, self._words, self._name = course, words, name
        self._header, self._settings, self._rejects = header, settings, rejects
        self._recorder: TrajectoryRecorder | None = None

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._recorder = TrajectoryRecorder(
            task, self._header, self._settings.pictures, self._rejects
        )
        self._intents: Iterator[Intent] | None = None

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The episode's next action, with the thoughts before it."""
        recorder = self._recorder
        assert recorder is not None
        recorder.take_result(info)
        self._course.view = View.of(obs, info)
        if self._intents is None:
            self._intents = self._course.intents()
        intent = next(self._intents)
        recorder.begin_turn(intent, obs, info)
        now = len(recorder.turns) - 1
        if now >= len(self._words.turns):  # the replay has come out differently
            return Decision(intent.action)
        said = self._words.turns[now]
        recorder.pay([said.reply])
        limits = self._settings.kinds.limits["alone"]
        thoughts = recorder.think_own(now, said.thoughts, self._name, limits)
        return Decision(intent.action, thoughts_text(thoughts))

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The pictures and the trajectory, by path; empty if the episode crashed."""
        return {} if self._recorder is None else self._recorder.attachments(episode, stem)


@dataclass(frozen=True)
class Replayers:
    """Play selected episodes again; :class:`~agents.expert.players.Players`.

    Attributes:
        make_writer: makes the writer of thoughts for agents that left none; picklable.
        candidates: by id, to say in the end which replays differ.
        rewrite: whether that writer writes all thoughts, also of models that thought.
        strict: whether the critic must find no fault in any thought.
    """

    make_writer: Callable[[], ThoughtWriter]
    candidates: Mapping[str, Candidate] = field(default_factory=dict)
    rewrite: bool = False
    strict: bool = False
    name: str = "replay"
    obs_mode: str = OBS_MODE
    scripted: bool = False

    def make(
        self, candidates: Mapping[str, Candidate], settings: PlaySettings, most_actions: int
    ) -> MakeAgent:
        """See :class:`~agents.expert.players.Players`."""
        return partial(self._agent, candidates, settings)

    def _agent(
        self, candidates: Mapping[str, Candidate], settings: PlaySettings, task: Task, seed: int
    ) -> Agent:
        candidate = candidates[task.id]
        run = _run(Path(candidate.run))
        episode = run.episode(candidate.episode)
        rejects = partial(replay_rejection, episode=episode, strict=self.strict)
        header = header_of(candidate, settings)
        course = ReplayedCourse(task, steps_of(episode))
        words = None if self.rewrite else recorded_replies(run.path, episode)
        if words is None or words.silent:
            return ThinkingAgent(
                course,
                header,
                settings.kinds,
                self.make_writer(),
                settings.pictures,
                seed,
                rejects=rejects,
            )
        spoken_in = replace(header, language=words.language)
        return QuotingAgent(course, words, candidate.actor, spoken_in, settings, rejects)

    def rejection(self, trajectory: Trajectory, most_actions: int) -> str:
        """Why a replay is not taken, ``""`` if it is."""
        candidate = self.candidates[trajectory.id]
        try:
            episode = _run(Path(candidate.run)).episode(candidate.episode)
        except ValueError:
            return DIFFERS
        return replay_rejection(trajectory, episode=episode, strict=self.strict)


def replay_rejection(trajectory: Trajectory, *, episode: EpisodeRecord, strict: bool) -> str:
    """Why the replay of an episode is not taken, ``""`` if it is.

    Args:
        trajectory: the replay.
        episode: what was played.
        strict: whether the critic must find no fault in any thought.
    """
    if not trajectory.success or any(_differences(trajectory, episode)):
        return DIFFERS
    if strict and any(each.refused for turn in trajectory.turns for each in turn.thoughts):
        return CRITIC
    return ""


def _differences(trajectory: Trajectory, episode: EpisodeRecord) -> Iterator[str]:
    """What came out differently; the first difference is enough, since the rest follows."""
    before = episode.steps[0]
    for turn, step in zip_longest(trajectory.turns, steps_of(episode)):
        if turn is None or step is None:
            yield "the number of steps"
            return
        for name in ("navigable", "interactable"):
            if getattr(turn, name) != getattr(before, name):
                yield name
        for name in ("verb", "object_type", "object_id", "success", "reward"):
            if getattr(turn, name) != getattr(step, name):
                yield name
        if as_now(turn.feedback) != as_now(step.feedback):
            yield "feedback"
        before = step
    if trajectory.end_reason != episode.end_reason:
        yield "end_reason"


@lru_cache(maxsize=8)
def _run(path: Path) -> RunDirectory:
    return RunDirectory.open(path)
