"""A trained policy that travels to workers which do not see its files."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from agents.rl.policy_file import CONFIG, policy_file
from er_gym.rollout.agent import Agent
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class CarriedPolicy:
    """Makes agents of a trained policy from its files' contents, in any process: a
    :class:`.rollout.agent.MakeAgent`.

    Attributes:
        files: contents by file name; the first is the policy's.
    """

    files: Mapping[str, bytes] = field(repr=False)

    @classmethod
    def of(cls, run: Path) -> CarriedPolicy:
        """The policy of a run directory or model file.

        Raises:
            ValueError: there is none.
            OSError: its files cannot be read.
        """
        file = policy_file(run)
        return cls({each.name: each.read_bytes() for each in (file, file.parent / CONFIG)})

    def __call__(self, task: Task, seed: int) -> Agent:
        """Make the agent of an episode."""
        from agents.rl.agent import RLAgent  # late: torch

        return RLAgent(_unpacked(tuple(self.files.items())))


@lru_cache(maxsize=4)
def _unpacked(files: tuple[tuple[str, bytes], ...]) -> Path:
    """The policy's file in a folder of this process."""
    folder = Path(tempfile.mkdtemp(prefix="er-gym-policy-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, data in files:
        (folder / name).write_bytes(data)
    return folder / files[0][0]
