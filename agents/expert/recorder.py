"""Records an episode as a trajectory: what was seen, thought and done at each turn."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.expert.course import Intent
from agents.expert.legs import in_language
from agents.vlm.chat import Picture
from agents.vlm.pictures import encode
from agents.vlm.settings import Pictures
from er_gym.data.collection import PLAYED
from er_gym.data.critic import check
from er_gym.data.dialects import shows_anew
from er_gym.data.knowledge import Knowledge, knowledge_at
from er_gym.data.train_rule import learnt
from er_gym.data.trajectory import (
    Correction,
    Cost,
    Language,
    PictureRecord,
    SeenObject,
    ThoughtKind,
    ThoughtRecord,
    Trajectory,
    Turn,
    with_results,
)
from er_gym.envs.info import detail
from er_gym.envs.object_view import ObjectView
from er_gym.rollout.agent import ModelReply
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import PICTURES
from er_gym.tasks import verbs
from er_gym.tasks.task import Task
from er_gym.writing import file_stem

OBS_MODE = "rgb+objects"
"""The observations that a trajectory is recorded from."""
AHEAD = "ahead"
FOLDERS = (PICTURES, PLAYED)
"""The folders of a run directory for what a recorder leaves."""


def joined_modes(*modes: str) -> str:
    """The observations that several modes ask for, as one mode; ``""`` asks for none."""
    names = [name for mode in modes for name in mode.split("+") if name]
    return "+".join(dict.fromkeys(names))


@dataclass(frozen=True)
class TrajectoryHeader:
    """The fields of a trajectory that are known before the episode begins.

    Attributes:
        task_id, part, kind, mode, language, actor, correction: as
            :class:`~er_gym.data.trajectory.Trajectory` has them.
        folder: the part's directory, relative to the collection; ``""`` for a run directory of its
            own.
    """

    task_id: str
    part: str = ""
    kind: str = ""
    mode: str = ""
    language: Language = "en"
    actor: str = "expert"
    folder: str = ""
    correction: Correction | None = None


class TrajectoryRecorder:
    """Records one episode, turn by turn.

    At each step, :meth:`take_result` comes first, then :meth:`begin_turn` with what the agent
    decides. Thoughts can be added at any time (:meth:`think`).

    Args:
        task: the task.
        header: what the trajectory says of itself.
        pictures: how pictures are encoded; None to record none.
        rejects: why a trajectory will not be taken, ``""`` if it will. Only a trajectory that will
            be taken leaves its pictures.

    Attributes:
        turns: those so far.
        pictures_now: the pictures of the present turn.
    """

    def __init__(
        self,
        task: Task,
        header: TrajectoryHeader,
        pictures: Pictures | None,
        rejects: Callable[[Trajectory], str],
    ) -> None:
        self._task, self._header, self._pictures, self._rejects = task, header, pictures, rejects
        self.turns: list[Turn] = []
        self.pictures_now: tuple[Picture, ...] = ()
        self._faults: list[str] = []
        self._files: dict[str, bytes] = {}
        self._at = ""
        self._done = 0
        self._cost = Cost()

    def take_result(self, info: Mapping[str, Any]) -> None:
        """Record the result of the last action."""
        earned = info["key_actions_done"] > self._done
        self._done = info["key_actions_done"]
        if not self.turns:
            return
        last = self.turns[-1]
        done = bool(info["action_success"])
        fault = str(info["fault"])
        self._faults.append(fault)
        if done and last.verb == verbs.NAVIGATE:
            self._at = last.object_type
        self.turns[-1] = last.model_copy(
            update={
                "success": done,
                "reward": float(earned),
                "feedback": info["feedback"],
                "fault": fault,
                "object_id": info["object_id"],
            }
        )

    def begin_turn(self, intent: Intent, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin a turn, without thoughts."""
        pictures = self._encoded(obs, info)
        self.pictures_now = tuple(picture for _, picture in pictures)
        turn = Turn(
            pictures=[self._picture_record(*each) for each in pictures],
            view=_seen(detail(info, "object_views")),
            views={
                direction: _seen(views) for direction, views in info["object_views_around"].items()
            },
            held=info["held"],
            navigable=list(info["navigable"]),
            interactable=list(info["interactable"]),
            at=self._at,
            purpose=intent.purpose,
            subgoal=in_language(intent.subgoal, self._header.language),
            plan=list(intent.plan),
            verb=intent.action.verb,
            object_type=intent.action.object_type,
            train=intent.train,
        )
        self.turns.append(turn)

    def knowledge(self, index: int) -> Knowledge:
        """What the agent knows at a turn, with the thoughts of the turns before."""
        return knowledge_at(
            self.turns, index, instruction=self._task.instruction, language=self._header.language
        )

    def think(self, index: int, thoughts: Iterable[ThoughtRecord]) -> None:
        """Set the thoughts of a turn."""
        self.turns[index] = self.turns[index].model_copy(update={"thoughts": list(thoughts)})

    def think_own(
        self,
        index: int,
        thoughts: Iterable[tuple[ThoughtKind, str]],
        writer: str,
        limits: Mapping[ThoughtKind, int],
    ) -> list[ThoughtRecord]:
        """Set a turn's thoughts by the agent that decided it; refusals are only recorded.

        Args:
            index: of the turn.
            thoughts: kind and text.
            writer: who thought so.
            limits: the most words of a thought of each kind.
        """
        knowledge = self.knowledge(index)
        records = []
        for kind, text in thoughts:
            codes = [one.code for one in check(text, kind, knowledge, limit=limits[kind])]
            refused = [*dict.fromkeys(codes)]
            records.append(ThoughtRecord(kind=kind, text=text, writer=writer, refused=refused))
        self.think(index, records)
        return records

    def pay(self, replies: Iterable[ModelReply]) -> None:
        """Add the cost of replies, including cached ones, which an earlier try paid for."""
        for reply in replies:
            self._cost = Cost(
                requests=self._cost.requests + 1,
                prompt_tokens=self._cost.prompt_tokens + reply.prompt_tokens,
                completion_tokens=self._cost.completion_tokens + reply.completion_tokens,
                usd=self._cost.usd + reply.cost,
            )

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The pictures and the trajectory, by path; empty if the episode crashed."""
        if episode.error or not self.turns:
            return {}
        trajectory = self._trajectory(episode)
        record = (trajectory.model_dump_json() + "\n").encode()
        if self._rejects(trajectory):
            return {f"{PLAYED}/{stem}.json": record}
        return {**self._files, f"{PLAYED}/{stem}.json": record}

    def will_be_taken(self, episode: EpisodeRecord) -> bool:
        """Whether the trajectory of an episode that is over will be taken."""
        return not (episode.error or not self.turns or self._rejects(self._trajectory(episode)))

    def _trajectory(self, episode: EpisodeRecord) -> Trajectory:
        task, header = self._task, self._header
        trajectory = Trajectory(
            id=task.id,
            task_id=header.task_id,
            task_type=episode.task_type,
            scene=episode.scene,
            instruction=episode.instruction,
            name=episode.name,
            key_actions=episode.key_actions,
            search_targets=episode.search_targets or [],
            seed=episode.seed,
            part=header.part,
            kind=header.kind,
            mode=header.mode,
            language=header.language,
            actor=header.actor,
            max_steps=episode.max_steps,
            turns=with_results(self.turns, self._faults, episode),
            success=episode.success,
            end_reason=episode.end_reason,
            correction=header.correction,
            cost=self._cost,
        )
        turns = [
            turn.model_copy(update={"train": flag})
            for turn, flag in zip(trajectory.turns, learnt(trajectory), strict=True)
        ]
        return trajectory.model_copy(update={"turns": turns})

    def _encoded(
        self, obs: Mapping[str, Any], info: Mapping[str, Any]
    ) -> list[tuple[str, Picture]]:
        """The pictures of a turn with their directions; none after an action that failed and left
        the view as it was."""
        if self._pictures is None:
            return []
        around: Mapping[str, NDArray[np.uint8]] = info["views"]
        if around:
            return [(name, encode(frame, self._pictures)) for name, frame in around.items()]
        picture = encode(obs["rgb"], self._pictures)
        last = self.turns[-1] if self.turns else None
        shown_last = next(reversed(self._files.values()), b"")
        if shows_anew(last is None or last.success, picture.data, shown_last):
            return [(AHEAD, picture)]
        return []

    def _picture_record(self, direction: str, picture: Picture) -> PictureRecord:
        kind = picture.media_type.removeprefix("image/")
        name = f"{PICTURES}/{file_stem(self._task.id)}/{len(self._files):03}.{kind}"
        self._files[name] = picture.data
        path = f"{self._header.folder}/{name}" if self._header.folder else name
        return PictureRecord(
            path=path, direction=direction, width=picture.width, height=picture.height
        )


def total_reply(replies: Sequence[ModelReply]) -> ModelReply | None:
    """The sum of a turn's replies, as a decision states it; None for none."""
    if not replies:
        return None
    return ModelReply(
        model=replies[-1].model,
        seconds=sum(each.seconds for each in replies),
        prompt_tokens=sum(each.prompt_tokens for each in replies),
        completion_tokens=sum(each.completion_tokens for each in replies),
        cost=sum(each.cost for each in replies),
        cached=all(each.cached for each in replies),
    )


def thoughts_text(thoughts: Iterable[ThoughtRecord]) -> str:
    """A turn's thoughts as one text."""
    return "\n".join(thought.text for thought in thoughts)


def _seen(views: tuple[ObjectView, ...]) -> list[SeenObject]:
    return [SeenObject.of(view) for view in views]
