"""The agent that follows a course and says why: it leaves a trajectory beside its episode."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agents.expert.course import Course, Intent, View
from agents.expert.thought_kinds import Event, ThoughtKinds
from agents.expert.writers.base import ThoughtRequest, ThoughtWriter
from agents.vlm.chat import Picture
from agents.vlm.pictures import encode
from agents.vlm.settings import Pictures
from er_gym.data.collection import PLAYED
from er_gym.data.knowledge import knowledge_at
from er_gym.data.trajectory import (
    Correction,
    Cost,
    Language,
    PictureRecord,
    SeenObject,
    ThoughtRecord,
    Trajectory,
    Turn,
    with_results,
)
from er_gym.envs.object_view import ObjectView
from er_gym.rollout.agent import Decision, ModelReply
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import PICTURES
from er_gym.tasks import verbs
from er_gym.tasks.task import Task
from er_gym.writing import file_stem

OBS_MODE = "rgb+objects"
AHEAD = "ahead"


@dataclass(frozen=True)
class TrajectoryHeader:
    """What a trajectory says of itself before it begins.

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


class ThinkingAgent:
    """Does what a course decides, writes the thoughts, and records the trajectory.

    Args:
        course: decides.
        header: what the trajectory says of itself.
        kinds: which kinds of thoughts are drawn.
        writer: writes them.
        pictures: how pictures are encoded.
        seed: of the draws.
        rejects: why a trajectory will not be taken, ``""`` if it will. Only a trajectory that will
            be taken leaves its pictures.
    """

    obs_mode = OBS_MODE
    attachment_folders = (PICTURES, PLAYED)

    def __init__(
        self,
        course: Course,
        header: TrajectoryHeader,
        kinds: ThoughtKinds,
        writer: ThoughtWriter,
        pictures: Pictures,
        seed: int,
        rejects: Callable[[Trajectory], str] = lambda trajectory: "",
    ) -> None:
        self._rejects = rejects
        self._course, self._header = course, header
        self._kinds, self._writer, self._pictures = kinds, writer, pictures
        self._seed, self._random = seed, Random(seed)
        self._task: Task | None = None

    # -- the agent's protocol --------------------------------------------------------------------

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._task = task
        self._intents: Iterator[Intent] | None = None
        self._turns: list[Turn] = []
        self._faults: list[str] = []
        self._files: dict[str, bytes] = {}
        self._at = ""
        self._done = 0
        self._cost = Cost()

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Decide, think, and act.

        Raises:
            ModelError: the writer's model gives no reply in this episode.
            CannotGoOn: no later request can succeed either.
        """
        assert self._task is not None
        self._take_result(info)
        self._course.view = View.of(info)
        if self._intents is None:
            self._intents = self._course.intents()
        intent = next(self._intents)
        pictures = self._encoded(obs, info)
        turn = self._begun_turn(intent, pictures, info)
        event = self._event(intent)
        kinds = self._kinds.draw(event, self._random)
        self._turns.append(turn)
        knowledge = knowledge_at(
            self._turns,
            len(self._turns) - 1,
            instruction=self._task.instruction,
            language=self._header.language,
        )
        written = self._writer.write(
            ThoughtRequest(
                knowledge=knowledge,
                kinds=kinds,
                limits=self._kinds.limits_of(kinds),
                pictures=tuple(picture for _, picture in pictures),
                seed=self._random.getrandbits(48),
            )
        )
        self._add_cost(written.replies)
        self._turns[-1] = turn.model_copy(update={"thoughts": list(written.thoughts)})
        reply = written.replies[-1] if written.replies else None
        return Decision(intent.action, _spoken(written.thoughts), reply)

    # -- the trajectory --------------------------------------------------------------------------

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The pictures and the trajectory, by path; empty if the episode crashed."""
        if self._task is None or episode.error or not self._turns:
            return {}
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
            turns=with_results(self._turns, self._faults, episode),
            success=episode.success,
            end_reason=episode.end_reason,
            correction=header.correction,
            cost=self._cost,
        )
        if self._rejects(trajectory):
            return {f"{PLAYED}/{stem}.json": _bytes(course_only(trajectory))}
        return {**self._files, f"{PLAYED}/{stem}.json": _bytes(trajectory)}

    def _take_result(self, info: Mapping[str, Any]) -> None:
        """Note what came of the last action."""
        earned = len(info["key_actions_done"]) > self._done
        self._done = len(info["key_actions_done"])
        if not self._turns:
            return
        last = self._turns[-1]
        done = bool(info["action_success"])
        fault = str(info.get("fault", ""))
        self._faults.append(fault)
        if done and last.verb == verbs.NAVIGATE:
            self._at = last.object_type
        self._turns[-1] = last.model_copy(
            update={
                "success": done,
                "reward": float(earned),
                "feedback": info["feedback"],
                "fault": fault,
                "object_id": info["object_id"],
            }
        )

    def _begun_turn(
        self, intent: Intent, pictures: list[tuple[str, Picture]], info: Mapping[str, Any]
    ) -> Turn:
        """A turn without its thoughts and results; its pictures are added to the files."""
        return Turn(
            pictures=[self._picture_record(*each) for each in pictures],
            view=_seen(info["object_views"]),
            views={
                direction: _seen(views)
                for direction, views in info.get("object_views_around", {}).items()
            },
            held=info["held"],
            navigable=list(info["navigable"]),
            interactable=list(info["interactable"]),
            at=self._at,
            purpose=intent.purpose,
            subgoal=intent.subgoal,
            plan=list(intent.plan),
            verb=intent.action.verb,
            object_type=intent.action.object_type,
            train=intent.train,
        )

    def _encoded(
        self, obs: Mapping[str, Any], info: Mapping[str, Any]
    ) -> list[tuple[str, Picture]]:
        """The pictures of a turn with their directions; none after an action that failed and left
        the view as it was."""
        around: Mapping[str, NDArray[np.uint8]] = info.get("views", {})
        if around:
            return [(name, encode(frame, self._pictures)) for name, frame in around.items()]
        picture = encode(obs["rgb"], self._pictures)
        last = self._turns[-1] if self._turns else None
        if last is not None and not last.success and self._is_last_picture(picture):
            return []
        return [(AHEAD, picture)]

    def _is_last_picture(self, picture: Picture) -> bool:
        last = next(reversed(self._files.values()), b"")
        return last == picture.data

    def _picture_record(self, direction: str, picture: Picture) -> PictureRecord:
        assert self._task is not None
        kind = picture.media_type.removeprefix("image/")
        name = f"{PICTURES}/{file_stem(self._task.id)}/{len(self._files):03}.{kind}"
        self._files[name] = picture.data
        path = f"{self._header.folder}/{name}" if self._header.folder else name
        return PictureRecord(
            path=path, direction=direction, width=picture.width, height=picture.height
        )

    # -- thoughts --------------------------------------------------------------------------------

    def _event(self, intent: Intent) -> Event:
        """What the thoughts of this turn respond to."""
        if not self._turns:
            return "begin"
        last = self._turns[-1]
        if not last.success:
            return "failed"
        if intent.purpose == "repeat":
            return "careless"
        if intent.checked == "check" or intent.checked == "think and check":
            return intent.checked  # type: ignore[return-value]
        if intent.purpose == "finish":
            return "done"
        return "earned" if last.earned else "fruitless"

    def _add_cost(self, replies: Any) -> None:
        replies = list(replies)
        if replies:
            self._cost = _sum_costs(self._cost, replies)


def course_only(trajectory: Trajectory) -> Trajectory:
    """A trajectory without what it saw and thought, to save space: its actions and results."""
    lists = ("pictures", "view", "thoughts", "navigable", "interactable")
    bare: dict[str, Any] = {"views": {}, **{name: [] for name in lists}}
    turns = [turn.model_copy(update=bare) for turn in trajectory.turns]
    return trajectory.model_copy(update={"turns": turns})


def _bytes(trajectory: Trajectory) -> bytes:
    return (trajectory.model_dump_json() + "\n").encode()


def _spoken(thoughts: tuple[ThoughtRecord, ...]) -> str:
    return "\n".join(thought.text for thought in thoughts)


def _seen(views: tuple[ObjectView, ...]) -> list[SeenObject]:
    return [SeenObject.of(view) for view in views]


def _sum_costs(cost: Cost, replies: list[ModelReply]) -> Cost:
    """A cost with some replies added."""
    return Cost(
        requests=cost.requests + sum(not each.cached for each in replies),
        prompt_tokens=cost.prompt_tokens + sum(each.prompt_tokens for each in replies),
        completion_tokens=cost.completion_tokens + sum(each.completion_tokens for each in replies),
        usd=cost.usd + sum(each.cost for each in replies),
    )
