"""Who plays the candidates of a collection, and which trajectories are taken."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Protocol

from agents.expert.acceptance import PlayedCourse, rejection
from agents.expert.candidates import Candidate
from agents.expert.places import DrawnPlaces, PlaceChooser
from agents.expert.recorder import OBS_MODE, TrajectoryHeader
from agents.expert.thinker import ThinkingAgent
from agents.expert.thought_kinds import ThoughtKinds
from agents.expert.writers.base import ThoughtWriter
from agents.vlm.settings import Pictures
from er_gym.data.collection import PARTS
from er_gym.data.remembered import searches_for_the_seen
from er_gym.data.trajectory import Correction, Language, Trajectory
from er_gym.rollout.agent import Agent, MakeAgent
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class PlaySettings:
    """What all players of a collection share.

    Attributes:
        kinds: which kinds of thoughts are drawn.
        pictures: how pictures are encoded; None to record none.
        language: of the thoughts.
    """

    kinds: ThoughtKinds
    pictures: Pictures | None
    language: Language


class Players(Protocol):
    """Makes the agents of a collection."""

    @property
    def name(self) -> str:
        """Who decides, as the parts' manifests name it; ``""`` for the actor of the part."""

    @property
    def obs_mode(self) -> str:
        """The observations that the agents need."""

    @property
    def scripted(self) -> bool:
        """Whether the agents do what the candidates' courses decide, so that a prescreening shows
        the results of their episodes."""

    def make(
        self, candidates: Mapping[str, Candidate], settings: PlaySettings, most_actions: int
    ) -> MakeAgent:
        """What makes the agent of a candidate's episode; picklable for processes.

        Args:
            candidates: by id.
            settings: of the collection.
            most_actions: longer trajectories are not taken.
        """

    def rejection(self, trajectory: Trajectory, most_actions: int) -> str:
        """Why a trajectory is not taken, ``""`` if it is."""


@dataclass(frozen=True)
class Thinkers:
    """Agents that follow scripted courses and write thoughts; :class:`Players`.

    Attributes:
        make_writer: makes the writer of thoughts; picklable for processes.
        make_places: makes what chooses the wrong places of an episode with this seed.
        think_later: see :class:`~agents.expert.thinker.ThinkingAgent`.
    """

    make_writer: Callable[[], ThoughtWriter]
    make_places: Callable[[int], PlaceChooser] = field(default_factory=lambda: _drawn_places)
    think_later: bool = False
    name: str = ""
    obs_mode: str = OBS_MODE
    scripted: bool = True

    def make(
        self, candidates: Mapping[str, Candidate], settings: PlaySettings, most_actions: int
    ) -> MakeAgent:
        """See :class:`Players`."""
        return partial(self._agent, candidates, settings, most_actions)

    def _agent(
        self,
        candidates: Mapping[str, Candidate],
        settings: PlaySettings,
        most_actions: int,
        task: Task,
        seed: int,
    ) -> Agent:
        candidate, places = candidates[task.id], self.make_places(seed)
        return ThinkingAgent(
            candidate.course(seed, settings.kinds, places),
            header_of(candidate, settings),
            settings.kinds,
            self.make_writer(),
            settings.pictures,
            seed,
            rejects=partial(self.rejection, most_actions=most_actions),
            places=places,
            think_later=self.think_later,
            beginning=candidate.beginning,
        )

    def rejection(self, trajectory: Trajectory, most_actions: int) -> str:
        """See :func:`agents.expert.acceptance.rejection`; nor is one that searches for what it has
        seen, as an explorer's or a searcher's may."""
        reason = rejection(PlayedCourse.of_trajectory(trajectory), most_actions)
        if not reason and any(searches_for_the_seen(trajectory)):
            return "it searches for what it has seen"
        return reason


def header_of(candidate: Candidate, settings: PlaySettings) -> TrajectoryHeader:
    """The header of a candidate's trajectory."""
    correction = None
    if candidate.beginning is not None:
        correction = Correction(
            run=candidate.run,
            episode=candidate.episode,
            first_wrong=candidate.beginning.first_wrong,
            agent=candidate.beginning.agent,
        )
    return TrajectoryHeader(
        task_id=candidate.task.id,
        part=candidate.part,
        kind=candidate.kind,
        mode=candidate.mode,
        language=settings.language,
        actor=candidate.said_actor,
        folder=f"{PARTS}/{candidate.part}",
        correction=correction,
    )


def _drawn_places(seed: int) -> PlaceChooser:
    return DrawnPlaces()
