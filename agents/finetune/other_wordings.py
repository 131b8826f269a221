"""Instructions told in other words, so that a model learns more ways to ask for the same."""

from __future__ import annotations

import random

from agents.finetune.settings import DataSettings
from agents.finetune.word_noise import with_word_noise
from er_gym.data.trajectory import Trajectory
from er_gym.tasks.wordings.instructions import further_instruction


def as_learnt(trajectory: Trajectory, settings: DataSettings) -> Trajectory:
    """A trajectory with the instruction from which a model is to learn it.

    It is first told in other words (:func:`with_other_wording`), and then some of these are made
    up (:func:`~agents.finetune.word_noise.with_word_noise`).
    """
    told = with_other_wording(trajectory, settings.other_wordings)
    return with_word_noise(told, settings.word_noise)


def with_other_wording(trajectory: Trajectory, share: float) -> Trajectory:
    """A trajectory whose English instruction is perhaps told in a further wording.

    A tiny model reads "get the Mug from the room" as it reads the nearest wording that it knows,
    and only looks for the Mug. None of the further wordings is kept for evaluation, so
    measurements in a suite's seen and unseen wordings stay what they are.

    Args:
        trajectory: what was recorded. It stays as it is if its instruction is not in English, or
            its task's name is none that er-gym generates.
        share: the probability, from 0 to 1, with which it is told anew. The same trajectory and
            share always give the same words, in each epoch and run.
    """
    if not share or not trajectory.instruction.isascii():
        return trajectory
    if random.Random(f"{trajectory.id}/other").random() >= share:
        return trajectory
    said = further_instruction(trajectory.name, trajectory.id, trajectory.scene)
    return trajectory if said is None else trajectory.model_copy(update={"instruction": said})
