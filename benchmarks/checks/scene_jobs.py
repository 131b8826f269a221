"""Options of the fuzz and the soak: which scenes, and how many processes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import numpy as np

from er_gym.rollout.worker_pool import LostJob, run_jobs
from er_gym.thor import SCENE_NAMES

Job = TypeVar("Job")
Result = TypeVar("Result")


def choose_scenes(asked: str) -> list[str]:
    """Scenes by number, spread over the kinds of room; "all"; or names separated by commas.

    Raises: ValueError: the text has another form.
    """
    if asked == "all":
        return list(SCENE_NAMES)
    if asked.isdecimal() and 1 <= int(asked) <= len(SCENE_NAMES):
        chosen = np.linspace(0, len(SCENE_NAMES), int(asked), endpoint=False).astype(int)
        return [SCENE_NAMES[k] for k in chosen]
    names = asked.split(",")
    unknown = [name for name in names if name not in SCENE_NAMES]
    if unknown:
        raise ValueError(
            f"--scenes takes all, a number from 1 to {len(SCENE_NAMES)} or names such as "
            f"FloorPlan1,FloorPlan201; not {unknown[0]!r}"
        )
    return names


def run_scene_jobs(
    make: Callable[[], Callable[[Job], Result]], jobs: Sequence[Job], workers: int
) -> Iterator[tuple[Job, Result | LostJob]]:
    """Do every job once in ``workers`` processes (1: in this process)."""
    if workers == 1:
        do = make()
        return ((job, do(job)) for job in jobs)
    return run_jobs(make, jobs, workers=workers, tries=1)
