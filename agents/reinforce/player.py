"""Plays episodes with the model that learns: the ordinary agent, loop and client, and an ear."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from agents.reinforce.episodes import Episode, Turn, steps_of
from agents.vlm.agent import VLMAgent
from agents.vlm.chat import Message, Reply
from agents.vlm.clients.local import LocalClient, Spoken
from agents.vlm.matching import Matcher
from agents.vlm.prompt_set import PromptSet
from agents.vlm.settings import AgentSettings
from er_gym.rollout.agent import Decision
from er_gym.rollout.env_pool import EnvPool, RemoteEnv
from er_gym.rollout.executor import EpisodeSettings, PlayedEpisode
from er_gym.rollout.play import Playable
from er_gym.rollout.records import episode_key
from er_gym.rollout.run_directory import Manifest
from er_gym.rollout.thread_executor import play_in_pool
from er_gym.tasks.task import Task

ANCHOR = "anchor"
"""The observation beside the agent's own."""


class Listener:
    """A client that keeps what the model said, in tokens; for one agent."""

    def __init__(self, client: LocalClient) -> None:
        self._client = client
        self.heard: list[Spoken] = []

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        """The model's next turn."""
        self.heard.append(self._client.spoken(messages, seed))
        return self.heard[-1].reply

    def close(self) -> None:
        """Nothing: the client is the run's."""


class Player:
    """An agent with what it was asked at each turn, and what its model said.

    Args:
        agent: the agent, whose client is ``listener``.
        begun: whether its conversation has begun, as after a fork; it is not reset then.
        forks: whether to keep the conversation before each turn.

    Attributes:
        anchors: of the turns.
        forks: the agent before each turn; empty unless they are kept.
        snapshots: of the environment before each turn, if somebody adds them.
    """

    def __init__(
        self, agent: VLMAgent, listener: Listener, *, begun: bool = False, forks: bool = False
    ) -> None:
        self.obs_mode = f"{agent.obs_mode}+{ANCHOR}"
        self.anchors: list[str] = []
        self.forks: list[VLMAgent] = []
        self.snapshots: list[bytes] = []
        self._agent, self._listener = agent, listener
        self._begun, self._keeps = begun, forks

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode, or take one up."""
        if not self._begun:
            self._agent.reset(task, obs, info)

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """What the agent decides."""
        self.anchors.append(info[ANCHOR])
        if self._keeps:
            self.forks.append(self._agent.fork())
        return self._agent.act(obs, info)

    def turns(self) -> tuple[Turn, ...]:
        """What the model said; without a turn in which it gave no reply."""
        return tuple(
            Turn(spoken.prompt, spoken.said, spoken.scores, anchor, spoken.pictures)
            for spoken, anchor in zip(self._listener.heard, self.anchors, strict=False)
        )


@dataclass(frozen=True)
class Job:
    """An episode to be played.

    Attributes:
        task: of the episode.
        key: names it among those that are played together.
        sample: its number in its group, from 1.
        seed: of the episode.
        agent: the conversation that it goes on with, and ``snapshot`` the environment; None for an
            episode from the beginning.
        start: the turn, from 0, before which they were taken.
        turns: how many it goes on at most; None for as many as the episode has left.
    """

    task: Task
    key: str
    sample: int
    seed: int
    agent: VLMAgent | None = None
    snapshot: bytes | None = None
    start: int = 0
    turns: int | None = None


class _Played:
    """Keeps the records of episodes that are over."""

    def __init__(self) -> None:
        self.by_key: dict[str, PlayedEpisode] = {}

    def save(self, played: PlayedEpisode) -> None:
        self.by_key[played.record.task_id] = played

    def ended(self, played: PlayedEpisode) -> None:
        """Nothing: nobody waits for it."""


@dataclass
class Sampler:
    """Plays episodes in a pool of environments that stays open.

    Attributes:
        pool: the environments; their ``obs_mode`` is the agent's with :data:`ANCHOR`.
        client: the model.
        settings, prompts, matcher: of the agent.
        manifest: what is played, for the records.
    """

    pool: EnvPool
    client: LocalClient
    settings: AgentSettings
    prompts: PromptSet
    matcher: Matcher
    manifest: Manifest
    players: dict[str, Player] = field(default_factory=dict)

    def play(
        self, jobs: Sequence[Job], *, forks: bool = False
    ) -> list[tuple[Job, Episode, Player]]:
        """Play episodes, as many at once as the pool has slots.

        Args:
            jobs: what is played.
            forks: whether to keep conversation and environment before each turn.

        Returns:
            those that did not crash, in the order of the jobs.

        Raises:
            CannotGoOn: no episode can be played any more.
            RuntimeError: every episode crashed; the message has the first error.
        """
        by_key = {job.key: job for job in jobs}
        players = self.players = {}
        sink = _Played()

        def make(task: Task, seed: int) -> Player:
            job, listener = by_key[task.id], Listener(self.client)
            if job.agent is not None:
                agent, begun = job.agent.fork(listener, seed), True
            else:
                agent, begun = (
                    VLMAgent(listener, self.settings, self.prompts, self.matcher, seed), False,
                )  # fmt: skip
            # A try after a lost process replaces the one before.
            players[task.id] = Player(agent, listener, begun=begun, forks=forks)
            return players[task.id]

        def dress(env: RemoteEnv, task: Task) -> Playable:
            job = by_key[task.id]
            if job.snapshot is not None:
                return _TakenUp(env, task, job.snapshot, job.turns)
            return _Saved(env, players[task.id]) if forks else env

        play_in_pool(
            self.pool,
            EpisodeSettings(self.manifest, {job.key: job.seed for job in jobs}),
            [replace(job.task, id=job.key) for job in jobs],
            make,
            sink,
            dress=dress,
        )
        return self._results(jobs, sink, players)

    def _results(
        self, jobs: Sequence[Job], sink: _Played, players: Mapping[str, Player]
    ) -> list[tuple[Job, Episode, Player]]:
        found, errors = [], []
        for job in jobs:
            record = sink.by_key[job.key].record
            if record.error:
                errors.append(record.error)
                continue
            record = record.model_copy(update={"task_id": job.task.id, "sample": job.sample})
            turns = players[job.key].turns()
            if len(turns) == len(steps_of(record)):
                made = Episode(record, turns, start=job.start)
                found.append((job, made, players[job.key]))
        if errors and not found:
            raise RuntimeError(f"all {len(errors)} episodes crashed; the first: {errors[0]}")
        return found


class _Dressed:
    """Something around an environment that looks like it."""

    def __init__(self, env: RemoteEnv) -> None:
        self._env = env

    @property
    def unwrapped(self) -> RemoteEnv:
        return self._env


class _Saved(_Dressed):
    """Gives a player a snapshot before each turn."""

    def __init__(self, env: RemoteEnv, player: Player) -> None:
        super().__init__(env)
        self._player = player

    def reset(self, **arguments: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        answer = self._env.reset(**arguments)
        self._player.snapshots.append(self._env.snapshot())
        return answer

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        answer = self._env.step(action)
        if not (answer[2] or answer[3]):
            self._player.snapshots.append(self._env.snapshot())
        return answer


class _TakenUp(_Dressed):
    """Begins where a snapshot was taken, and is over after some turns."""

    def __init__(self, env: RemoteEnv, task: Task, snapshot: bytes, turns: int | None) -> None:
        super().__init__(env)
        self._task, self._snapshot = task, snapshot
        self._left = sys.maxsize if turns is None else turns

    def reset(self, **arguments: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        return self._env.restore(self._task, self._snapshot)

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        self._left -= 1
        obs, reward, terminated, truncated, info = self._env.step(action)
        return obs, reward, terminated, truncated or self._left <= 0, info


def group_jobs(tasks: Sequence[Task], group: int, seed: Callable[[str], int]) -> list[Job]:
    """Each task as often as a group has episodes; ``seed`` gives that of an episode's key."""
    keys = [
        (task, number, episode_key(task.id, number))
        for task in tasks
        for number in range(1, group + 1)
    ]
    return [Job(task, key, number, seed(key)) for task, number, key in keys]
