"""The agent that follows a course and writes thoughts: it records a trajectory of its episode."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

from agents.expert.corrections import Beginning
from agents.expert.course import Course, Intent, View
from agents.expert.places import DrawnPlaces, PlaceChooser
from agents.expert.recorder import (
    FOLDERS,
    OBS_MODE,
    TrajectoryHeader,
    TrajectoryRecorder,
    thoughts_text,
    total_reply,
)
from agents.expert.thought_kinds import Event, ThoughtKinds
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter, WrittenThoughts
from agents.vlm.chat import Picture
from agents.vlm.settings import Pictures
from er_gym.data.trajectory import ThoughtKind, Trajectory, Turn
from er_gym.rollout.agent import Decision
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.task import Task

__all__ = ["OBS_MODE", "ThinkingAgent", "TrajectoryHeader"]


class ThinkingAgent:
    """Does what a course decides, writes the thoughts, and records the trajectory.

    Args:
        course: decides.
        header: the fields of the trajectory that are known beforehand.
        kinds: which kinds of thoughts are drawn.
        writer: writes them.
        pictures: how pictures are encoded; None to record none.
        seed: of the draws.
        rejects: see :class:`~agents.expert.recorder.TrajectoryRecorder`.
        places: chooses the course's wrong places; what that costs is the trajectory's too.
        think_later: whether thoughts are written when the episode is over, and only if the
            trajectory will be taken: for writers that cost something. The thoughts are the same.
        beginning: what the course repeats first; its agent's own thoughts are kept, if it has them.
    """

    obs_mode = OBS_MODE
    attachment_folders = FOLDERS

    def __init__(
        self,
        course: Course,
        header: TrajectoryHeader,
        kinds: ThoughtKinds,
        writer: ThoughtWriter,
        pictures: Pictures | None,
        seed: int,
        rejects: Callable[[Trajectory], str] = lambda trajectory: "",
        places: PlaceChooser = DrawnPlaces(),  # noqa: B008 (has no state)
        think_later: bool = False,
        beginning: Beginning | None = None,
    ) -> None:
        self._think_later = think_later
        self._beginning = beginning or Beginning()
        self._course, self._header, self._rejects = course, header, rejects
        self._kinds, self._writer, self._pictures = kinds, writer, pictures
        self._random, self._places = Random(seed), places
        self._recorder: TrajectoryRecorder | None = None

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._recorder = TrajectoryRecorder(task, self._header, self._pictures, self._rejects)
        self._intents: Iterator[Intent] | None = None
        self._thoughtless: dict[int, _Thoughtless] = {}

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Decide, think, and act.

        Raises:
            CannotGoOn: a model is asked, and no later request can succeed either.
        """
        recorder = self._recorder
        assert recorder is not None
        recorder.take_result(info)
        self._course.view = View.of(obs, info)
        if self._intents is None:
            self._intents = self._course.intents()
        intent = next(self._intents)
        kinds = self._kinds.draw(_event(intent, recorder.turns), self._random)
        recorder.begin_turn(intent, obs, info)
        replies = self._places.take_replies()
        recorder.pay(replies)
        this = _Thoughtless(kinds, recorder.pictures_now, self._random.getrandbits(48))
        now = len(recorder.turns) - 1
        if now < len(self._beginning.said):
            own = recorder.think_own(
                now, self._beginning.said[now], self._beginning.agent, self._kinds.limits["alone"]
            )
            return Decision(intent.action, thoughts_text(own), total_reply(replies))
        if self._think_later:
            self._thoughtless[now] = this
            return Decision(intent.action, reply=total_reply(replies))
        written = self._think(recorder, now, this)
        return Decision(
            intent.action,
            thoughts_text(written.thoughts),
            total_reply((*replies, *written.replies)),
        )

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The pictures and the trajectory, by path; empty if the episode crashed.

        Raises:
            CannotGoOn: thoughts are written now, and no later request can succeed either.
        """
        recorder = self._recorder
        if recorder is None:
            return {}
        if self._thoughtless and recorder.will_be_taken(episode):
            for index, each in self._thoughtless.items():
                self._think(recorder, index, each)
        return recorder.attachments(episode, stem)

    def _think(
        self, recorder: TrajectoryRecorder, index: int, turn: _Thoughtless
    ) -> WrittenThoughts:
        """Write the thoughts of a turn."""
        written = self._writer.write(
            ThoughtRequest(
                knowledge=recorder.knowledge(index),
                kinds=turn.kinds,
                limits=self._kinds.limits_of(turn.kinds),
                pictures=turn.pictures,
                seed=turn.seed,
            )
        )
        recorder.pay(written.replies)
        recorder.think(index, written.thoughts)
        return written


@dataclass(frozen=True)
class _Thoughtless:
    """What the thoughts of a turn need beside the record of the turns."""

    kinds: tuple[ThoughtKind, ...]
    pictures: tuple[Picture, ...]
    seed: int


def _event(intent: Intent, turns: Sequence[Turn]) -> Event:
    """What the thoughts of a turn respond to.

    Args:
        intent: what is decided.
        turns: those before it.
    """
    if not turns:
        return "begin"
    last = turns[-1]
    if not last.success:
        return "failed"
    if intent.train and not last.train and last.purpose != "repeat" and not last.earned:
        return "failed"  # the mistake that a correction begins with
    if intent.purpose == "repeat":
        return "careless"
    if intent.checked == "check" or intent.checked == "think and check":
        return intent.checked  # type: ignore[return-value]
    if intent.purpose == "finish":
        return "done"
    return "earned" if last.earned else "fruitless"
