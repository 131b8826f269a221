"""What an agent that is said to have played would do and think, for a replay to compare.

Whoever knows the agents of a collection gives a :class:`Reenact`; ``er-gym data verify`` does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from er_gym.data.collection import CollectionManifest
from er_gym.data.trajectory import Trajectory
from er_gym.tasks.task import Task


class Reenactment(Protocol):
    """One trajectory, played anew by the agent that is said to have played it.

    Attributes:
        header: fields of the trajectory and what they must be.
    """

    header: Mapping[str, Any]

    def decide(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Mapping[str, Any]:
        """Fields of the next turn and what they must be, before its action.

        Args:
            obs, info: what the environment gave, ``info`` with its details.
        """


class Reenact(Protocol):
    """Makes the reenactments of a collection; picklable, for worker processes."""

    def __call__(
        self, manifest: CollectionManifest, task: Task, trajectory: Trajectory
    ) -> Reenactment | None:
        """The reenactment of a trajectory; None if nothing tells how its agent decided.

        Args:
            manifest: the collection's.
            task: the trajectory's, with its own id.
            trajectory: what was recorded.
        """

    def writes(self, manifest: CollectionManifest, trajectory: Trajectory) -> bool:
        """Whether a reenactment writes the thoughts of a trajectory anew, too."""


@dataclass(frozen=True)
class Nobody:
    """Makes no reenactments: :class:`Reenact` of who knows no agents."""

    def __call__(self, manifest: CollectionManifest, task: Task, trajectory: Trajectory) -> None:
        """See :class:`Reenact`."""

    def writes(self, manifest: CollectionManifest, trajectory: Trajectory) -> bool:
        """See :class:`Reenact`."""
        return False


NOBODY = Nobody()
