"""Records of episodes, which hold all that scoring needs without the environment.

The records are wire formats: one :class:`EpisodeRecord` is one JSON file. A change that an older
reader would misread takes a new ``format``.
"""

from __future__ import annotations

import operator
import re
from functools import partial
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from er_gym.tasks.judge import search_targets
from er_gym.tasks.paper_records import odd_spellings
from er_gym.tasks.task import Task
from er_gym.tasks.verbs import INIT
from er_gym.writing import writable

ERROR = "error"
"""The verb recorded for a reply that named no known action."""
GAVE_UP = "gave up"
"""Why an episode ended that the agent could not finish."""

_SAMPLE = re.compile(r"\.sample([1-9]\d*)\Z")

PERSON: Final = "person"
"""Who decided a step in place of the agent."""
By: TypeAlias = Literal["", "person"]
"""Who decided a step: ``""`` for the agent itself."""

Words: TypeAlias = Annotated[str, AfterValidator(writable)]
"""A text of an agent, a model or an exception: it may hold characters that UTF-8 cannot hold."""


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


def added(default: Any, **constraints: Any) -> Any:
    """A field that a later version of er-gym has added to a kind of record. Where it has its
    default, the record is written without it, as before.

    A serializer in Python would do the same, but Ctrl-C while it runs would come out of pydantic as
    another error; here nothing that runs is Python code.

    Args:
        default: the default.
        constraints: of the value, as :func:`pydantic.Field` takes them.
    """
    is_default = partial(operator.is_ if default is None else operator.eq, default)
    return Field(default=default, exclude_if=is_default, **constraints)


def episode_key(task_id: str, sample: int = 1) -> str:
    """The name of an episode among those of its run: the task's id, and the number of the sample
    where it is not the first."""
    return task_id if sample == 1 else f"{task_id}.sample{sample}"


def task_of_key(key: str) -> str:
    """The id of the task whose episode has a key (:func:`episode_key`)."""
    return _SAMPLE.sub("", key)


def sample_of_key(key: str) -> int:
    """Which of its task's episodes has a key (:func:`episode_key`), from 1."""
    found = _SAMPLE.search(key)
    return int(found[1]) if found else 1


class KeyActionRecord(_Record):
    """A key action of the task, as its file states it.

    Attributes:
        verb: canonical (see :mod:`er_gym.tasks.verbs`).
        object_id: the AI2-THOR id of its object, ``""`` for ``end``.
        object_type: the type that the task file states, which may be empty or wrong.
        reward: the reward for doing it.
        exact: whether it must be done to that object, not just to any object of its type.
        spelled: the verb as the task's file spells it, ``""`` for the spelling of the paper's
            files.
    """

    verb: str
    object_id: str = ""
    object_type: str = ""
    reward: float = 1.0
    exact: bool = False
    spelled: str = ""


class StepRecord(_Record):
    """One step, and the types that were legal targets after it.

    Attributes:
        verb: canonical; ``init`` for the first step, in which the agent is placed; :data:`ERROR`
            for a reply that named no known action.
        object_type: as the agent named it.
        object_id: the object that the name stood for, ``""`` for none.
        success: whether the action was legal and the simulator did it.
        feedback: what the environment told the agent.
        navigable, interactable: object types that were legal targets after the step.
        reward: what the step earned.
        thought: the agent's reasoning.
        text: the action as the agent gave it.
        appended: whether the protocol took the step instead of the agent: the ``end`` that the
            paper's runner appends (:data:`er_gym.envs.protocol.PAPER`).
        by: who decided the step in place of the agent; ``""`` if nobody did.
        causes: why the model's reply was not usable, by names of
            :data:`er_gym.rollout.causes.CAUSES`.
        fault: the kind of fault that was injected into the action (:mod:`er_gym.envs.faults`),
            ``""`` for none: such a failure is not the agent's.
    """

    verb: str
    object_type: Words = ""
    object_id: str = ""
    success: bool
    feedback: Words = ""
    navigable: list[str] = []
    interactable: list[str] = []
    reward: float = 0.0
    thought: Words = ""
    text: Words = ""
    appended: bool = False
    by: By = added("")
    causes: list[str] = added([])
    fault: str = added("")


class EpisodeRecord(_Record):
    """One episode of one task.

    Attributes:
        format: the version of this layout.
        task_id, task_type, scene, instruction, name, key_actions: attributes of the task;
            ``task_type`` is the paper's name of the type and ``name`` the instruction before
            paraphrase.
        max_steps: the episode's step limit; placing the agent counts as the first step.
        agent: the agent's spec.
        seed: the seed of this episode (not of the run).
        steps: from ``init`` to the last.
        success: the environment's verdict; scores are computed from the steps.
        goal_unmet: the conditions of the task's goal that did not hold at ``end``, in words.
        search_targets: the types that the task searches for, empty if it is not a search; None in a
            record that was written before records had this field.
        end_reason: why it ended, in the environment's words; :data:`GAVE_UP` if the agent could
            not finish it; ``""`` if it crashed.
        total_reward: the sum over the steps.
        seconds: wall-clock time.
        error: the error it crashed with, in one line; ``""`` if it did not crash.
        run: in a run directory, the digest of the run's manifest; ``""`` elsewhere, and in records
            written before this field existed.
        sample: which of the task's episodes it is, from 1.
        cause: of an episode that the agent could not finish, the name of the cause
            (:data:`er_gym.rollout.causes.CAUSES`), and ``gave_up`` what happened, in one line.
        side_effects: what the agent changed that the task did not ask for
            (:mod:`er_gym.tasks.side_effects`); None where that is not known: in a record that was
            written before records had this field, and in an episode that was broken off.
    """

    format: Literal["er-gym/episode/1"] = "er-gym/episode/1"
    task_id: str
    task_type: str
    scene: str
    instruction: str
    name: str
    key_actions: list[KeyActionRecord]
    max_steps: int = Field(gt=0)
    agent: str
    seed: int
    steps: list[StepRecord]
    success: bool
    goal_unmet: list[str] = []
    search_targets: list[str] | None = None
    end_reason: str
    total_reward: float
    seconds: float
    error: Words = ""
    run: str = ""
    sample: int = added(1, ge=1)
    cause: str = added("")
    gave_up: Words = added("")
    side_effects: list[str] | None = added(None)

    @property
    def key(self) -> str:
        """Its name among the episodes of its run, from which those of its files are derived."""
        return episode_key(self.task_id, self.sample)

    @property
    def predicted(self) -> list[StepRecord]:
        """The steps that the agent asked for by naming a known action."""
        return [step for step in self.steps if step.verb not in (INIT, ERROR) and not step.appended]

    @property
    def num_steps(self) -> int:
        """The number of recorded steps, including ``init`` and ``end`` but not :data:`ERROR`."""
        return sum(step.verb != ERROR for step in self.steps)


def record_episode(
    task: Task,
    *,
    agent: str,
    seed: int,
    max_steps: int | None = None,
    steps: list[StepRecord] | None = None,
    success: bool = False,
    goal_unmet: list[str] | None = None,
    end_reason: str = "",
    seconds: float = 0.0,
    error: str = "",
    cause: str = "",
    gave_up: str = "",
    side_effects: list[str] | None = None,
) -> EpisodeRecord:
    """The record of an episode of a task.

    ``max_steps=None`` stands for the task's own limit.
    """
    steps = steps or []
    return EpisodeRecord(
        task_id=task.id,
        task_type=task.type.name,
        scene=task.scene,
        instruction=task.instruction,
        name=task.name or task.instruction,
        key_actions=[
            KeyActionRecord(
                verb=key.verb,
                object_id=key.object_id,
                object_type=key.object_type,
                reward=key.reward,
                exact=key.object_id in task.named,
                spelled=spelled,
            )
            for key, spelled in zip(task.key_actions, odd_spellings(task), strict=True)
        ],
        max_steps=task.max_steps if max_steps is None else max_steps,
        agent=agent,
        seed=seed,
        steps=steps,
        success=success,
        goal_unmet=goal_unmet or [],
        search_targets=sorted(search_targets(task)),
        end_reason=end_reason,
        total_reward=sum(step.reward for step in steps),
        seconds=seconds,
        error=error,
        cause=cause,
        gave_up=gave_up,
        side_effects=side_effects,
    )
