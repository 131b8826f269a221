"""A model that decides every action itself: its episodes are recorded as trajectories."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from agents.expert.candidates import Candidate, Candidates
from agents.expert.course import Intent, View
from agents.expert.explorer import Strength
from agents.expert.legs import at_hand, legs_of
from agents.expert.players import PlaySettings, header_of
from agents.expert.recipe import Part, Recipe
from agents.expert.recorded_replies import KIND_OF_TAG
from agents.expert.recorder import (
    FOLDERS,
    OBS_MODE,
    TrajectoryHeader,
    TrajectoryRecorder,
    joined_modes,
    thoughts_text,
)
from agents.expert.replayed_intents import replayed_purpose
from agents.expert.writers.prompts import WriterPrompts
from agents.factory import AgentFactory
from agents.vlm.agent import VLMAgent
from er_gym.data.trajectory import Subgoal, Trajectory
from er_gym.envs.actions import Action
from er_gym.rollout.agent import Agent, Decision, MakeAgent
from er_gym.rollout.records import ERROR, EpisodeRecord
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

MODEL = "model"
"""The kind of a trajectory whose actions a model decided, and the part that has them."""


class DecidingAgent:
    """Lets a vision-language agent decide and think, and records the trajectory.

    The thoughts are the model's own, so the critic's objections are only recorded. A turn whose
    action was refused is not to be learnt from.

    Args:
        agent: decides.
        name: of the model.
        header: what the trajectory says of itself.
        settings: of the collection.
        rejects: see :class:`~agents.expert.recorder.TrajectoryRecorder`.
        instruct: the instruction that the agent is given for a task; the trajectory has the task's.
    """

    attachment_folders = FOLDERS

    def __init__(
        self,
        agent: VLMAgent,
        name: str,
        header: TrajectoryHeader,
        settings: PlaySettings,
        rejects: Callable[[Trajectory], str],
        instruct: Callable[[Task], str] = lambda task: task.instruction,
    ) -> None:
        self.obs_mode = joined_modes(OBS_MODE, agent.obs_mode)
        self._agent, self._name, self._header = agent, name, header
        self._settings, self._rejects, self._instruct = settings, rejects, instruct
        self._recorder: TrajectoryRecorder | None = None

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._recorder = TrajectoryRecorder(
            task, self._header, self._settings.pictures, self._rejects
        )
        self._legs = legs_of(task)
        self._agent.reset(replace(task, instruction=self._instruct(task)), obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Ask the model, and record what it thinks and decides.

        Raises:
            ModelError: the model gives no reply in this episode.
            CannotGoOn: no later request can succeed either.
        """
        recorder = self._recorder
        assert recorder is not None
        recorder.take_result(info)
        decision = self._agent.act(obs, info)
        action = decision.action if isinstance(decision.action, Action) else Action(ERROR)
        intent = Intent(
            action,
            replayed_purpose(action, info["held"]),
            self._subgoal(View.of(obs, info)),
            plan=(action.object_type,) if action.verb == verbs.NAVIGATE else (),
        )
        recorder.begin_turn(intent, obs, info)
        thoughts = recorder.think_own(
            len(recorder.turns) - 1,
            [(KIND_OF_TAG[each.kind], each.text) for each in self._agent.rounds[-1].thoughts],
            self._name,
            self._settings.kinds.limits["alone"],
        )
        if decision.reply is not None:
            recorder.pay([decision.reply])
        return Decision(
            decision.action, thoughts_text(thoughts), decision.reply, causes=decision.causes
        )

    def attachments(self, episode: EpisodeRecord, stem: str) -> dict[str, bytes]:
        """The pictures and the trajectory, by path; empty if the episode crashed."""
        return {} if self._recorder is None else self._recorder.attachments(episode, stem)

    def _subgoal(self, view: View) -> Subgoal:
        """What the next action may be for: the first part of the task that is not done."""
        here = at_hand(self._legs, view.left)
        return here[1] if here else Subgoal()


@dataclass(frozen=True)
class Deciders:
    """A model that decides; :class:`~agents.expert.players.Players`.

    Attributes:
        factory: makes the agents that ask it.
        prompts: the texts of the hint.
        hint: whether the model gets the task's key actions as a hint.
        strict: whether the critic must accept every thought.
    """

    factory: AgentFactory
    prompts: WriterPrompts
    hint: bool = False
    strict: bool = False

    @property
    def scripted(self) -> bool:
        """False: a model's decisions are not known before it plays."""
        return False

    @property
    def name(self) -> str:
        """The model's name."""
        return self.factory.name

    @property
    def obs_mode(self) -> str:
        """See :class:`~agents.expert.players.Players`."""
        return joined_modes(OBS_MODE, self.factory.settings.obs_mode)

    def make(
        self, candidates: Mapping[str, Candidate], settings: PlaySettings, most_actions: int
    ) -> MakeAgent:
        """See :class:`~agents.expert.players.Players`; not picklable, for threads only."""

        def make_agent(task: Task, seed: int) -> Agent:
            return DecidingAgent(
                self.factory.agent(seed),
                self.name,
                header_of(candidates[task.id], settings),
                settings,
                partial(self.rejection, most_actions=most_actions),
                self._instruction,
            )

        return make_agent

    def rejection(self, trajectory: Trajectory, most_actions: int) -> str:
        """Why a trajectory is not taken, ``""`` if it is: it must succeed, and every reply name an
        action."""
        if not trajectory.success:
            return "no success"
        if trajectory.actions > most_actions:
            return "too long"
        if any(turn.verb == ERROR for turn in trajectory.turns):
            return "a reply named no action"
        if not any(turn.thoughts for turn in trajectory.turns):
            return "no thoughts"
        refused = any(each.refused for turn in trajectory.turns for each in turn.thoughts)
        return "the critic refuses a thought" if self.strict and refused else ""

    def _instruction(self, task: Task) -> str:
        return self.prompts.told_plan(task) if self.hint else task.instruction


@dataclass(frozen=True)
class ModelCandidates:
    """The candidates of a sequence, played by a model.

    Attributes:
        candidates: the sequence.
        name: of the model.
    """

    candidates: Candidates
    name: str

    @property
    def length(self) -> int | None:
        """How many there are; None for any number."""
        return self.candidates.length

    def __getitem__(self, index: int) -> Candidate:
        one = self.candidates[index]
        again = one.id.removeprefix(f"{one.task.id}-{one.kind}")
        return replace(
            one,
            id=f"{one.task.id}-{MODEL}{again}",
            actor=self.name,
            kind=MODEL,
            mode="",
            explorer="",
            strength=None,
        )


def model_recipe(recipe: Recipe) -> Recipe:
    """A recipe of one part, with the task types of all parts of another."""
    types: dict[str, int] = {}
    for part in recipe.parts.values():
        for name, number in part.types.items():
            types[name] = types.get(name, 0) + number
    most = max(part.most_actions for part in recipe.parts.values())
    played = Part(
        actor="explorer", types=types, explorers={MODEL: Strength()}, direct=1.0, most_actions=most
    )
    return Recipe(parts={MODEL: played})
