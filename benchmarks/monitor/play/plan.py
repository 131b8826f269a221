"""What a session plays: the tasks, who acts, and the run that is written."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from agents import RL_PREFIX, NamedAgent, make_agent
from agents.factory import is_model_agent
from agents.vlm.clients.registry import CLIENTS
from agents.vlm.settings import Pictures
from agents.zoo.index import PREFIX as ZOO_PREFIX
from benchmarks.monitor.play.person import HUMAN, person_agent
from er_gym import __version__
from er_gym.rollout.agent import MakeAgent
from er_gym.rollout.events import Cost
from er_gym.rollout.run_directory import Manifest, RunDirectory
from er_gym.rollout.selection import select
from er_gym.tasks.resolve import ResolvedTasks, resolve_tasks
from er_gym.tasks.suites import Suite, comes_with_er_gym, load_suite, suite_names
from er_gym.tasks.task import Task
from er_gym.writing import file_stem

if TYPE_CHECKING:
    from benchmarks.vlm_run import VLMRun

_SEED = 0
_BACKEND = "embedded"
_SEES = "rgb"
_KINDS = (RL_PREFIX.rstrip(":"), ZOO_PREFIX.rstrip(":"))


@dataclass(frozen=True)
class Cast:
    """Who acts in a run.

    Attributes:
        make: makes the agent of an episode.
        cost: what the run has cost so far.
    """

    make: MakeAgent
    cost: Callable[[], Cost | None] = lambda: None


@dataclass(frozen=True)
class Plan:
    """What a session plays.

    Attributes:
        path: the run directory.
        manifest: of the run.
        tasks: in this order; those that the run has an episode of are not played again.
        agent: who is watched, as ``er-gym bench --agent`` takes it; "" if a person plays alone.
        pictures: how pictures are shown.
        cast: who acts, for as long as the block lasts, in a run directory.
    """

    path: Path
    manifest: Manifest
    tasks: Sequence[Task]
    agent: str
    pictures: Pictures
    cast: Callable[[RunDirectory], AbstractContextManager[Cast]]


@lru_cache(maxsize=2)
def playable(suite: str) -> tuple[Suite, ResolvedTasks]:
    """One of er-gym's own suites, and its tasks that can be played.

    Raises:
        ValueError: there is no such suite, or it has not been generated yet.
    """
    if suite not in suite_names():  # another name could be a module, which would be run
        raise ValueError(f"there is no suite {suite!r:.80}; choose: {', '.join(suite_names())}")
    found = load_suite(suite)
    if comes_with_er_gym(found):
        return found, ResolvedTasks(found.tasks)
    return found, resolve_tasks(found.tasks, _BACKEND, arrange=False)


def run_path(folder: Path, suite: str, agent: str = "") -> Path:
    """Where the run of a suite is written."""
    return folder / f"{file_stem(suite)}-{file_stem(_named(agent))}"


def _named(agent: str) -> str:
    return f"{HUMAN}+{agent}" if agent else HUMAN


def plan(
    folder: Path,
    *,
    suite: str,
    type: str = "",
    task: str = "",
    agent: str = "",
    vlm_run: Callable[[str], VLMRun] | None = None,
) -> Plan:
    """Plan a session.

    Args:
        folder: holds the runs that are written.
        suite: one of er-gym's own.
        type: of tasks; "" for any.
        task: the id of the task, which must be of the type; "" for all of this type that have not
            been played.
        agent: see :class:`Plan`.
        vlm_run: the run of a vision-language agent by its name, with what the user says of the
            model; None if nothing is said of it.

    Raises:
        ValueError: something that was given does not exist or does not fit; the message says what
            is allowed.
    """
    found, fitted = playable(suite)
    chosen = select(fitted.tasks, task_ids=[task] if task else (), types=[type] if type else ())
    acting = _acting(agent, vlm_run)
    seen = acting.env["obs_mode"].split("+")
    shown = {"obs_mode": "+".join(seen if _SEES in seen else (*seen, _SEES))}
    manifest = Manifest(
        suite=found.name,
        suite_digest=found.digest,
        suite_size=len(fitted.tasks),
        agent=_named(agent),
        agent_settings=acting.settings,
        env={"backend": _BACKEND, **found.env, **acting.env, **shown},
        seed=_SEED,
        er_gym=__version__,
        set_aside=(*found.set_aside, *fitted.set_aside),
        taken=fitted.substitutions,
    )
    path = run_path(folder, suite, agent)
    return Plan(path, manifest, chosen, agent, acting.pictures, acting.cast)


@dataclass(frozen=True)
class _Acting:
    """What a run takes from its agent: the environment's arguments, settings, and the agents."""

    env: Mapping[str, Any]
    cast: Callable[[RunDirectory], AbstractContextManager[Cast]]
    pictures: Pictures = field(default_factory=Pictures)
    settings: dict[str, Any] = field(default_factory=dict)


def _acting(agent: str, vlm_run: Callable[[str], VLMRun] | None) -> _Acting:
    if not agent:
        alone = Cast(lambda task, seed: person_agent(seed))
        return _Acting({"obs_mode": _SEES}, lambda directory: nullcontext(alone))
    kind, colon, _ = agent.partition(":")
    if colon and kind not in _KINDS and kind not in CLIENTS.names():
        raise ValueError(
            "an agent of a module cannot be named here, since that would run the module; give one "
            "that er-gym has, or that an installed package declares"
        )
    if not is_model_agent(agent):
        named = Cast(NamedAgent(agent))
        obs_mode = make_agent(agent).obs_mode
        return _Acting({"obs_mode": obs_mode}, lambda directory: nullcontext(named))
    from benchmarks.vlm_run import VLMRun

    run = (vlm_run or VLMRun.of)(agent)
    return _Acting(
        run.env,
        lambda directory: _with_model(run, directory),
        run.settings.pictures,
        run.comparable_settings,
    )


@contextmanager
def _with_model(run: VLMRun, directory: RunDirectory) -> Iterator[Cast]:
    name = _named(run.name)
    with closing(run.factory(directory.path)) as factory:
        yield Cast(lambda task, seed: factory.agent(seed, name), lambda: factory.cost)
