"""Trajectories: the wire format of what an agent saw, thought and did, turn by turn.

A :class:`Trajectory` is one JSON object; a collection (:mod:`er_gym.data.collection`) holds one a
line. Training files of all formats are derived from trajectories. A change that an older reader
would misread takes a new ``format``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from er_gym.envs.actions import Action
from er_gym.envs.object_view import ObjectView, Side
from er_gym.rollout.records import EpisodeRecord, KeyActionRecord, Words

FORMAT = "er-gym/trajectory/1"
ThoughtKind: TypeAlias = Literal["analysis", "reasoning", "planning", "reflection", "verification"]
"""The paper's five kinds of thoughts: situation analysis, spatial reasoning, task planning,
self-reflection and double verification."""
THOUGHT_KINDS: tuple[ThoughtKind, ...] = (
    "analysis",
    "reasoning",
    "planning",
    "reflection",
    "verification",
)
TAG_OF_KIND: Mapping[ThoughtKind, str] = {
    "analysis": "Observation",
    "reasoning": "Thinking",
    "planning": "Planning",
    "reflection": "Reflection",
    "verification": "Verification",
}
"""The tag in which the paper's raw trajectories write a thought of each kind."""
Language: TypeAlias = Literal["en", "zh"]
Purpose: TypeAlias = Literal[
    "search",  # go to a place where the object may be
    "approach",  # go to something that is in view, or that was seen before
    "look around",  # observe: no place is left, or several were wrong
    "get closer",  # a step ahead, so that the object comes within reach
    "open to look",  # open a container to see what is inside
    "close again",  # close a container that was opened
    "take",
    "carry",  # go with the held object to its destination
    "open to put",
    "put",
    "put down",  # put away what was taken by mistake
    "switch",  # toggle
    "use",  # any other interaction that the task asks for: slice, close a microwave, ...
    "check",  # move a little, to look at the result once more
    "retry",  # the same action again, because it failed
    "repeat",  # the same action again without need: a mistake on purpose
    "finish",  # end
]
"""Why an action is taken."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class SeenObject(_Record):
    """An object in view, as :class:`er_gym.envs.object_view.ObjectView` describes it.

    Attributes:
        type: the object type.
        side: where it is in the picture.
        distance: metres from the agent to the object's centre, along the floor.
        on: the type of the visible receptacle that it lies in or on, ``""`` for none.
        open: whether it is open; None if it cannot be opened.
        toggled: whether it is switched on; None if it has no switch.
    """

    type: str
    side: Side
    distance: float
    on: str = ""
    open: bool | None = None
    toggled: bool | None = None

    @classmethod
    def of(cls, view: ObjectView) -> SeenObject:
        """The record of an object in view; the distance is rounded to centimetres."""
        return cls(
            type=view.object_type,
            side=view.side,
            distance=round(view.distance, 2),
            on=view.on,
            open=view.is_open,
            toggled=view.is_toggled,
        )


class PictureRecord(_Record):
    """A picture that the agent saw before a turn's decision.

    Attributes:
        path: the file, relative to the collection.
        direction: ``"ahead"``; after ``observe`` also ``"right"``, ``"behind"`` and ``"left"``.
        width, height: pixels.
    """

    path: str
    direction: str = "ahead"
    width: int
    height: int


class ThoughtRecord(_Record):
    """A thought.

    Attributes:
        kind: one of :data:`THOUGHT_KINDS`.
        text: without a tag.
        writer: who wrote it: ``grounded``, or a model such as ``openai:MODEL``.
        refused: why the critic refused earlier attempts, a code each (:mod:`er_gym.data.critic`).
            If the writer is ``grounded``, these were a model's, whose place it took, or its own. In
            a trajectory of the kind ``model`` or ``played``, where a model decided and thought in
            one reply, they are the reasons against this very thought.
    """

    kind: ThoughtKind
    text: Words
    writer: str = "grounded"
    refused: list[str] = []


class Subgoal(_Record):
    """The agent's current goal at a turn.

    Attributes:
        verb: what is to be done to ``thing``: ``find`` or a verb of the environment.
        thing: the type of the object that it is about; with ``put in``, the object to be put.
        place: the type of the destination that the instruction names, ``""`` for none. Once
            ``thing`` is in the hand, the agent searches for ``place`` or goes to it.
        text: the part of the instruction that it belongs to, in a task of several parts.
    """

    verb: str = "find"
    thing: str = ""
    place: str = ""
    text: str = ""


class Turn(_Record):
    """What the agent perceived, thought and did at one step, and the result.

    Attributes:
        pictures: what it was shown. Empty if its last action failed and nothing changed.
        view: the objects in view before the decision, nearest first.
        views: after ``observe``, the objects in view in each direction.
        held: the type of the object in its hand, ``""`` for none.
        navigable, interactable: the object types that were legal targets.
        at: the type that it last navigated to, ``""`` at first.
        purpose, subgoal, plan: the reasons for the action; ``plan`` lists the places that it plans
            to search, in order, the place of this turn's action first.
        thoughts: in the order in which it thought them.
        verb, object_type: the action.
        object_id: the object that the action was done to, ``""`` for none.
        success: whether the action was legal and was done.
        reward: what it earned.
        feedback: what the environment answered.
        fault: the fault that the environment injected into the action, ``""`` for none
            (:mod:`er_gym.envs.faults`).
        train: whether the turn is trained on.
    """

    pictures: list[PictureRecord] = []
    view: list[SeenObject] = []
    views: dict[str, list[SeenObject]] = {}
    held: str = ""
    navigable: list[str] = []
    interactable: list[str] = []
    at: str = ""
    purpose: Purpose
    subgoal: Subgoal = Subgoal()
    plan: list[str] = []
    thoughts: list[ThoughtRecord] = []
    verb: str
    object_type: str = ""
    object_id: str = ""
    success: bool = False
    reward: float = 0.0
    feedback: Words = ""
    fault: str = ""
    train: bool = True

    @property
    def action(self) -> Action:
        """The action."""
        return Action(self.verb, self.object_type)

    @property
    def earned(self) -> bool:
        """Whether the action did a key action."""
        return self.reward > 0


class Cost(_Record):
    """What a model's thoughts cost.

    Attributes:
        requests, prompt_tokens, completion_tokens: counts.
        usd: US dollars; 0 if no price is known.
    """

    requests: int = 0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    usd: float = 0.0


class Correction(_Record):
    """Where a corrected trajectory comes from.

    Attributes:
        run: the name of the run directory; ``episode``: the key of its failed episode, which is
            the task's id, with the number of the sample where it is not the first.
        first_wrong: the index of the turn after which the expert took over; by default the first
            one that left the key actions.
        agent: who failed, if the turns up to that one have its own thoughts; else ``""``.
    """

    run: str
    episode: str
    first_wrong: int
    agent: str = ""


class Trajectory(_Record):
    """One episode with pictures and thoughts.

    Attributes:
        format: the version of this layout.
        id: unique in its collection and usable as a file name.
        task_id, task_type, scene, instruction, name, key_actions, search_targets: the task's, as
            in :class:`er_gym.rollout.records.EpisodeRecord`.
        seed: the seed of the episode.
        part: the part of the collection, such as ``imitation``, ``exploration``, ``anomalies``.
        kind: ``a``, ``b`` or ``c`` for the expert's kinds of search, ``explored``, ``corrected``,
            ``model`` where a model decided, or ``played`` for selected episodes of runs and for
            episodes of other programs.
        mode: the expert's first plan: how many places and which is right, such as ``010``. For an
            explorer, ``search`` where nothing to be searched for was in view from the beginning.
        language: of the thoughts.
        actor: who decided: ``expert``, ``explorer``, or a model.
        max_steps: the step limit.
        turns: from the first action to the last, ``end`` included.
        success, end_reason: the environment's verdict.
        correction: where a corrected trajectory comes from.
        cost: what the thoughts cost; of a selected episode, what its replies cost in the run.
    """

    format: Literal["er-gym/trajectory/1"] = "er-gym/trajectory/1"
    id: str
    task_id: str
    task_type: str
    scene: str
    instruction: str
    name: str
    key_actions: list[KeyActionRecord]
    search_targets: list[str] = []
    seed: int
    part: str = ""
    kind: str
    mode: str = ""
    language: Language = "en"
    actor: str = "expert"
    max_steps: int = Field(gt=0)
    turns: list[Turn]
    success: bool
    end_reason: str
    correction: Correction | None = None
    cost: Cost = Cost()

    @property
    def actions(self) -> int:
        """How many actions it has, ``end`` included."""
        return len(self.turns)

    @property
    def pictures(self) -> int:
        """How many pictures it has."""
        return sum(len(turn.pictures) for turn in self.turns)


def with_results(turns: list[Turn], faults: list[str], episode: EpisodeRecord) -> list[Turn]:
    """Turns with the result of each action, read from the episode's record.

    Args:
        turns: one for each step that the agent took.
        faults: the injected fault of each turn, ``""`` for none; may be shorter than ``turns``.
        episode: the record; its first step places the agent.
    """
    steps = [step for step in episode.steps[1:] if not step.appended]
    padded = [*faults, *[""] * (len(turns) - len(faults))]
    return [
        turn.model_copy(
            update={
                "object_id": step.object_id,
                "success": step.success,
                "reward": step.reward,
                "feedback": step.feedback,
                "fault": fault,
            }
        )
        for turn, step, fault in zip(turns, steps, padded, strict=True)
    ]
