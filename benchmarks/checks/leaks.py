"""What test tasks share with training tasks, and what rewards say that success does not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.judgement import judged_by_step
from er_gym.rollout.records import EpisodeRecord
from er_gym.tables import Table
from er_gym.tasks.splits import UNSEEN_TYPES, subject_types, wording
from er_gym.tasks.suites import own_tasks
from er_gym.tasks.task import Task
from er_gym.tasks.verbs import END

_EPS = 1e-6


def shared(train: Sequence[Task], test: Sequence[Task]) -> dict[str, int]:
    """How many test tasks share something with training tasks, by what it is.

    Args:
        train: the tasks from which agents may learn.
        test: the tasks of a suite.
    """
    rooms = {task.scene for task in train}
    texts = {task.instruction for task in train}
    told = {(task.scene, task.instruction) for task in train}
    places = {name for task in train if (name := arrangement_of(task)) is not None}
    same = {_asked(task) for task in train}
    taught = {kind for task in train for kind in subject_types(task)}
    return {
        "room": sum(task.scene in rooms for task in test),
        "arrangement": sum(arrangement_of(task) in places for task in test),
        "room, arrangement and key actions": sum(_asked(task) in same for task in test),
        "instruction, to the letter": sum(task.instruction in texts for task in test),
        "room and instruction": sum((task.scene, task.instruction) in told for task in test),
        "object kept for evaluation that training is about": sum(
            bool(UNSEEN_TYPES & subject_types(task) & taught) for task in test
        ),
    }


def in_unseen_wording(train: Sequence[Task]) -> int:
    """How many training tasks are told in a wording that is kept for evaluation."""
    return sum(wording(task) == "unseen" for task in train)


def leak_table(suites: Sequence[str]) -> Table:
    """What the suites share with the training tasks."""
    train = own_tasks("train")
    found = {name: shared(train, own_tasks(name)) for name in suites}
    rows = [(what, *(str(found[name][what]) for name in suites)) for what in found[suites[0]]]
    held_back = str(in_unseen_wording(train))
    return Table(
        title=f"Tasks that share something with the {len(train):,} tasks of train",
        head=("What", *(f"{name}, of {len(own_tasks(name)):,}" for name in suites)),
        rows=(*rows, ("wording kept for evaluation", *[held_back] * len(suites))),
        text_columns=1,
    )


def arrangement_of(task: Task) -> tuple[Any, ...] | None:
    """The room and where its moved objects lie; None for a room as it was recorded."""
    poses = task.arrangement.poses
    return (task.scene, *sorted(poses.items(), key=lambda each: each[0])) if poses else None


def _asked(task: Task) -> tuple[Any, ...]:
    keys = tuple((key.verb, key.object_id) for key in task.key_actions)
    return task.scene, arrangement_of(task), task.type.name, keys


def unearned(record: EpisodeRecord) -> Iterator[str]:
    """Where an episode has got a reward without having come nearer to success.

    Each reward must be that of key actions that were left before the step and are done after it,
    and all of the task's reward is only to be had with success.
    """
    before: int | None = None
    for number, (step, progress) in enumerate(
        zip(record.steps, judged_by_step(record), strict=True)
    ):
        left = len(progress.left)
        if step.reward > _EPS and (before is None or left >= before):
            yield f"step {number} earns {step.reward:g}, and as many key actions are left"
        before = left
    whole = sum(key.reward for key in record.key_actions)
    ends = any(key.verb == END for key in record.key_actions)
    if record.total_reward > whole + _EPS:
        yield f"it earns {record.total_reward:g} of {whole:g}"
    elif ends and abs(record.total_reward - whole) < _EPS and not record.success:
        yield "it earns all of the reward without success"


def disagreements(record: EpisodeRecord) -> Iterator[str]:
    """Where the scorer, from the record alone, says otherwise than the environment said live."""
    again = score_episode(EpisodeRecord.model_validate_json(record.model_dump_json()), CORRECTED)
    if again.success != record.success:
        yield f"success is {record.success} live, {again.success} by the scorer"
    earned = sum(key.reward for key in judged_by_step(record)[-1].done)
    if abs(earned - record.total_reward) > _EPS:
        yield f"the reward is {record.total_reward:g} live, {earned:g} by the scorer"
