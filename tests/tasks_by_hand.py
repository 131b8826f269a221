"""A task made by hand, for the tests of file formats."""

from __future__ import annotations

from typing import Any

from er_gym.tasks import KeyAction, Task, task_type, verbs

MUG = "Mug|-00.38|+01.09|+03.19"
SINK = "Sink|-01.39|+00.98|+00.44|SinkBasin"
LONG = "long-range tasks with dependency relationships"


def wash_mug(scene: str, **fields: Any) -> Task:
    """To wash a Mug: with a reward, a type and related objects that are not the usual ones."""
    return Task(
        id=f"{scene}-wash-Mug",
        type=task_type(LONG),
        scene=scene,
        instruction="Wash that café’s Mug.",
        name="wash the Mug",
        key_actions=(
            KeyAction(verbs.PICKUP, MUG, "", reward=0.5),
            KeyAction(verbs.PUT, SINK, "SinkBasin", (SINK, MUG)),
            KeyAction(verbs.END),
        ),
        target_objects=(SINK,),
        related_objects=(MUG,),
        **fields,
    )
