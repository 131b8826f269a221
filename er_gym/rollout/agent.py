"""The protocol that every agent follows, whatever is inside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias, runtime_checkable

from er_gym.envs.actions import Action
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class ModelReply:
    """What a model's reply took.

    Attributes:
        model: the model's name, as its server gives it.
        seconds: how long the reply took.
        prompt_tokens, completion_tokens: as counted, or upper bounds.
        cost: in US dollars, 0 where no price is known.
        cached: whether an earlier request paid for it.
    """

    model: str = ""
    seconds: float = 0.0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    cost: float = 0.0
    cached: bool = False


@dataclass(frozen=True)
class Decision:
    """What an agent does next, and why.

    Attributes:
        action: anything that ``EmbodiedEnv.step`` takes: an :class:`~er_gym.envs.actions.Action`,
            its text, or its index.
        thought: what the agent said to itself; kept in the episode's record, never read by the env.
        reply: of an agent that asks a model, what its reply took.
    """

    action: Action | str | int
    thought: str = ""
    reply: ModelReply | None = None


class CannotGoOn(Exception):
    """No further episode can be played, this one included: a budget is spent, a key is refused.

    The run stops and shows the message. What has been played is kept.
    """


class Agent(Protocol):
    """Plays episodes: ``reset`` once for each, then ``act`` until the episode is over."""

    obs_mode: str
    """The observations it needs, as ``EmbodiedEnv(obs_mode=…)`` names them."""

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode; ``obs`` and ``info`` are what ``env.reset`` returned."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Decide, given what the last ``env.reset`` or ``env.step`` returned."""


class MakeAgent(Protocol):
    """Makes the agent of one episode. To play in other processes it has to be picklable."""

    def __call__(self, task: Task, seed: int) -> Agent:
        """Make an agent, given the task and the seed of the episode."""


Attachments: TypeAlias = Mapping[str, bytes]
"""Files that an agent leaves beside an episode's record: bytes by path in the run directory."""


@runtime_checkable
class LeavesAttachments(Protocol):
    """An agent that leaves files of its own, such as its conversation and the pictures it saw."""

    attachment_folders: Sequence[str]
    """Folders of the run directory that its files go to. In each, the files of an episode are
    ``STEM.*`` or in the folder ``STEM/``."""

    def attachments(self, episode: EpisodeRecord, stem: str) -> Attachments:
        """The files of the episode that is over or has crashed.

        Args:
            episode: its record.
            stem: what the names of its files begin with (:func:`.run_directory.file_stem`).
        """
