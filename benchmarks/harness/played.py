"""Episodes of an agent that are kept in a folder: a script that is run again plays the rest.

They are played in this process, in run directories that :mod:`er_gym.rollout.run_directory` reads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from agents import make_agent
from agents.factory import AgentFactory, comparable_settings, is_model_agent, load_settings
from agents.vlm.clients.registry import settings_file
from agents.vlm.prompts import prompts_for
from agents.zoo.index import weights_of
from er_gym import __version__
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import Agent
from er_gym.rollout.play import episode_seed, play_episode
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.runner import finished
from er_gym.tasks import jsonl_format
from er_gym.tasks.task import Task
from er_gym.writing import file_stem

_AT_ONCE = 8
"""As many episodes of a model at once: their turns are computed together."""


def played(
    work: Path,
    name: str,
    agent: str,
    tasks: Sequence[Task],
    *,
    env: Mapping[str, Any],
    seed: int = 0,
    settings: Sequence[str] = (),
) -> list[EpisodeRecord]:
    """The episodes of an agent, one of each task, in the order of the tasks.

    Those that are in the folder of the same manifest are read from there. The manifest holds the
    digest of the tasks, the arguments, and the digest of a zoo model's files: so what was played
    with other weights is not taken for this.

    Args:
        work: holds a folder for each manifest.
        name: of what is played, for people.
        agent: as :func:`agents.make_agent` takes it.
        tasks: no two have the same id.
        env: keyword arguments of the environment; the agent's own ``obs_mode`` is added.
        seed: of the run.
        settings: of a model agent, which override those that it was tuned for.

    Raises:
        RuntimeError: an episode crashed; those that were over are kept.
    """
    with _maker(agent, settings) as (make, its_env, told):
        manifest = Manifest(
            suite=name,
            suite_digest=jsonl_format.digest(tasks),
            suite_size=len(tasks),
            agent=agent,
            agent_settings=told,
            env={**its_env, **env},
            seed=seed,
            er_gym=__version__,
        )
        folder = work / f"{file_stem(f'{name}-{agent}')}-{manifest.digest}"
        with RunDirectory.locked(folder, manifest) as directory:
            done = {each.task_id for each in finished(directory, tasks)}
            left = [task for task in tasks if task.id not in done]
            shares = (
                [left[k::_AT_ONCE] for k in range(_AT_ONCE)] if is_model_agent(agent) else [left]
            )
            with ThreadPoolExecutor(len(shares)) as pool:
                for _ in pool.map(lambda share: _play(directory, share, make), shares):
                    pass
            found = {each.task_id: each for each in finished(directory, tasks)}
    return [found[task.id] for task in tasks]


def _play(directory: RunDirectory, tasks: Sequence[Task], make: Callable[[int], Agent]) -> None:
    manifest = directory.manifest
    env = EmbodiedEnv((), **manifest.env)
    try:
        for task in tasks:
            seed = episode_seed(manifest.seed, task.id)
            record = play_episode(env, make(seed), task, seed, agent_name=manifest.agent)
            if record.error:
                raise RuntimeError(f"{manifest.agent} in {task.id}: {record.error}")
            directory.write(record)
    finally:
        env.close()


@contextmanager
def _maker(
    agent: str, overrides: Sequence[str]
) -> Iterator[tuple[Callable[[int], Agent], dict[str, Any], dict[str, Any]]]:
    """What makes an agent from a seed, the environment's arguments that it asks for, and what
    decides how it plays, beside its name; that is empty for agents that are no models."""
    weights = weights_of(agent)
    if not is_model_agent(agent):
        yield (
            (lambda seed: make_agent(agent, seed)),
            {"obs_mode": make_agent(agent).obs_mode},
            weights,
        )
        return
    settings = load_settings(None, overrides, settings_file(agent))
    told = comparable_settings(settings, prompts_for(settings).digest)
    factory = AgentFactory(agent, settings)
    try:
        yield factory.agent, settings.env, {**told, **weights}
    finally:
        factory.close()
