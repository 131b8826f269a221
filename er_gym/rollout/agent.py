"""The protocol that every agent follows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Any, Protocol, TypeAlias, runtime_checkable

from er_gym.envs.actions import Action
from er_gym.rollout.records import By, EpisodeRecord
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class ModelReply:
    """What a model's reply cost.

    Attributes:
        model: the model's name, as its server gives it.
        seconds: how long the reply took.
        prompt_tokens, completion_tokens: as the server counted them, or upper bounds.
        cost: US dollars; 0 if no price is known.
        cached: whether the reply came from the cache, so that an earlier request paid for it.
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
        thought: the agent's reasoning; it is written into the episode's record, and the environment
            ignores it.
        reply: the cost of the model's reply, if the agent asks a model.
        by: who decided in place of the agent; ``""`` if nobody did.
        causes: why the reply was not usable, by names of :data:`er_gym.rollout.causes.CAUSES`.
    """

    action: Action | str | int
    thought: str = ""
    reply: ModelReply | None = None
    by: By = ""
    causes: tuple[str, ...] = ()


class CannotFinish(Exception):
    """The agent cannot finish this episode, and it would end in the same way if it were played
    again: a conversation does not fit into the model's context, a filter refuses it.

    The episode is over without success, its record has the cause, and the run goes on.

    Args:
        words: what happened, in one line.
        cause: the name of the cause (:data:`er_gym.rollout.causes.CAUSES`); "" for none of these.
    """

    def __init__(self, words: str, cause: str = "") -> None:
        super().__init__(words, cause)
        self.cause = cause

    def __str__(self) -> str:
        """What happened."""
        return str(self.args[0])


class CannotGoOn(Exception):
    """The agent can neither finish this episode nor play another: a budget is spent, a key refused.

    The run stops and shows the message. The episodes played before stay in the run directory.
    """


class Agent(Protocol):
    """Plays episodes: ``reset`` once for each, then ``act`` until the episode is over."""

    obs_mode: str
    """The observations that the agent needs, as ``EmbodiedEnv(obs_mode=…)`` names them."""

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode; ``obs`` and ``info`` are what ``env.reset`` returned.

        er-gym's own loop adds :class:`er_gym.envs.info.Details` to ``info``
        (:func:`er_gym.envs.info.with_details`).
        """

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Choose an action; ``obs`` and ``info`` are what the last reset or step returned, ``info``
        with details as in :meth:`reset`."""


def check_observation(agent: Agent, obs: Mapping[str, Any]) -> None:
    """Check that an observation has what an agent needs.

    Raises:
        ValueError: it lacks a kind of observation that ``agent.obs_mode`` names.
    """
    lacking = [name for name in agent.obs_mode.split("+") if name not in obs]
    if lacking:
        raise ValueError(
            f"{type(agent).__name__} needs the observation {' and '.join(map(repr, lacking))}, and "
            f"the environment gives {', '.join(map(repr, obs)) or 'none'}; make it with "
            f"obs_mode={agent.obs_mode!r}, or with obs_mode=agent.obs_mode"
        )


@runtime_checkable
class CanBeOverruled(Protocol):
    """An agent that can continue after another, or a person, has decided a step in its place."""

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Another decides this step; called in place of ``act``, with its arguments.

        The next ``act`` gets the result, as if the agent had decided it.
        """


class MakeAgent(Protocol):
    """Makes the agent of one episode. It must be picklable to play in worker processes."""

    def __call__(self, task: Task, seed: int) -> Agent:
        """Make an agent, given the task and the seed of the episode."""


Attachments: TypeAlias = Mapping[str, bytes]
"""Files that an agent leaves beside an episode's record: path in the run directory to bytes."""


@runtime_checkable
class LeavesAttachments(Protocol):
    """An agent that leaves files of its own, such as its conversation and the pictures it saw."""

    attachment_folders: Sequence[str]
    """The folders of the run directory for its files: plain names other than er-gym's own. In each
    folder, the files of an episode are ``STEM.SUFFIX``, or lie in the folder ``STEM/``."""

    def attachments(self, episode: EpisodeRecord, stem: str) -> Attachments:
        """The files of an episode that is over or has crashed.

        Args:
            episode: its record.
            stem: the beginning of the names of its files (:func:`.run_directory.file_stem`).
        """


_RESERVED = frozenset({"episodes", "run.json", "run.lock", "events.jsonl"})
"""Names in a run directory that no attachment may use."""


def check_attachments(files: Attachments, folders: Sequence[str], stem: str) -> None:
    """Check where an agent wants its files.

    Raises:
        ValueError: a folder is not a plain name, or is one of er-gym's own; or a path is neither
            ``FOLDER/STEM.SUFFIX`` nor within ``FOLDER/STEM/``.
        TypeError: a file's content is not bytes.
    """
    for folder in folders:
        if folder in ("", ".", "..") or "/" in folder or folder in _RESERVED:
            raise ValueError(
                f"attachment folder {folder!r} is not allowed; give a plain name other than: "
                f"{', '.join(sorted(_RESERVED))}"
            )
    for path, data in files.items():
        folder, *inner = path.split("/")
        # With one suffix only, a file of task "a" is never taken for one of task "a.b".
        beside = len(inner) == 1 and PurePosixPath(inner[0]).stem == stem and "." in inner[0]
        within = len(inner) > 1 and inner[0] == stem and not {"", ".", ".."}.intersection(inner)
        if folder not in folders or not (beside or within):
            raise ValueError(
                f"attachment {path!r} is not allowed; give FOLDER/{stem}.SUFFIX or "
                f"FOLDER/{stem}/NAME, with FOLDER one of: {', '.join(folders) or '(none declared)'}"
            )
        if not isinstance(data, bytes):
            raise TypeError(f"attachment {path!r} is {type(data).__name__}; give bytes")
