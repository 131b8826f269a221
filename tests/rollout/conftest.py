"""Fixtures of hand-made episodes and tasks."""

from episodes_by_hand import (  # noqa: F401
    episode,
    manifest,
    paper_tasks,
    run_directory,
    step,
    tasks_file,
)
