"""``er-gym doctor --ray``: what a Ray cluster has, and what would fail on it."""

from __future__ import annotations

import pickle
import secrets
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.cli.doctor_checks import Check
from er_gym.rollout.cluster.session import RayUnavailable, ray_backend
from er_gym.rollout.cluster.settings import RaySettings

_PATIENCE = 120.0
"""Seconds in which a node must have started a worker."""


def ray_checks(address: str, shared: Path | None) -> Iterator[Check]:
    """Check a cluster: what it has, and on each node whether a worker starts and plays.

    Args:
        address: as ``--ray-address`` takes it, ``""`` for a Ray that is started here.
        shared: a directory that all nodes are to see; None for none.
    """
    start = time.perf_counter()
    try:
        with ray_backend(RaySettings(address), lambda line: None):
            import ray

            took = time.perf_counter() - start
            nodes = [each for each in ray.nodes() if each["Alive"]]
            yield Check("ray", True, f"{ray.__version__}, {_where(address)} in {took:.1f} s")
            yield _resources(nodes)
            with _mark(shared) as mark:
                yield from _workers(nodes, mark)
    except RayUnavailable as error:
        problem, _, fix = str(error).partition("; ")
        yield Check("ray", False, problem, fix, required=True)


def _where(address: str) -> str:
    return f"joined {address}" if address else "started here"


def _resources(nodes: list[dict[str, Any]]) -> Check:
    """What the nodes have together, and whether a worker finds a place."""
    has = {
        name: sum(each["Resources"].get(name, 0) for each in nodes)
        for name in ("CPU", "GPU", "memory")
    }
    told = (
        f"{len(nodes)} nodes, {has['CPU']:g} CPU, {has['GPU']:g} GPU, "
        f"{has['memory'] / 2**30:.0f} GiB"
    )
    asks = RaySettings()
    fits = sum(
        int(min(each["Resources"].get("CPU", 0) / asks.cpus,
                each["Resources"].get("memory", 0) / asks.memory))
        for each in nodes
    )  # fmt: skip
    fix = "" if fits else "lower --worker-cpus or --worker-memory, or add nodes"
    return Check("cluster", bool(fits), f"{told}: {fits} workers", fix)


def _workers(nodes: list[dict[str, Any]], mark: tuple[Path, str] | None) -> Iterator[Check]:
    """Start a worker on each node at once, and let it look around."""
    import ray
    from ray.exceptions import RayError
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    from er_gym.rollout.cluster.actor_pool import first_line
    from er_gym.rollout.cluster.actors import JobActor, start_actor
    from er_gym.rollout.cluster.origin import Origin

    actors, begun = [], []
    for node in nodes:
        pinned = NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        actor = start_actor(JobActor, {"num_cpus": 0, "scheduling_strategy": pinned})
        actors.append(actor)
        begun.append(actor.begin.remote(Origin.here(), (), ray.cloudpickle.dumps(Probe)))
    for node, actor, ref in zip(nodes, actors, begun, strict=True):
        part = f"node {node['NodeManagerAddress']}"
        try:
            ready = ray.get(ref, timeout=_PATIENCE)
            done = None
            if not ready.problem:
                done = ray.get(actor.do.remote(pickle.dumps([mark])), timeout=_PATIENCE)
        except (RayError, TimeoutError) as error:
            yield Check(part, False, first_line(error), "look at Ray's logs there", required=True)
            continue
        finally:
            ray.kill(actor)
        if done is None:
            problem, _, fix = ready.problem.partition("; ")
            yield Check(part, False, problem, fix, required=True)
        else:
            (found,) = done.results
            fix = "" if found.sees_mark else "mount the directory under the same path there"
            yield Check(part, found.sees_mark, str(found), fix, required=True)


@dataclass(frozen=True)
class NodeReport:
    """What a worker found on its node.

    Attributes:
        host: its name.
        seconds: of an environment with pictures, from nothing to the first picture.
        sees_mark: whether it sees the shared directory, as this process does; True if none is
            asked for.
        memory: its resident memory with that environment, bytes.
    """

    host: str
    seconds: float
    sees_mark: bool
    memory: int

    def __str__(self) -> str:
        told = f"{self.host}, a picture after {self.seconds:.1f} s, {self.memory / 2**20:.0f} MiB"
        return told if self.sees_mark else f"{told}, but it does not see the shared directory"


class Probe:
    """Looks around on a node."""

    def __call__(self, mark: tuple[Path, str] | None) -> NodeReport:
        from er_gym.envs.embodied_env import EmbodiedEnv
        from er_gym.rollout.cluster.actors import resident_memory
        from er_gym.rollout.cluster.origin import Origin
        from er_gym.tasks import load_suite

        start = time.perf_counter()
        env = EmbodiedEnv(load_suite("mini").tasks[:1], obs_mode="rgb")
        try:
            env.reset(seed=0)
        finally:
            env.close()
        seconds = time.perf_counter() - start
        return NodeReport(Origin.here().host, seconds, _sees(mark), resident_memory())


def _sees(mark: tuple[Path, str] | None) -> bool:
    if mark is None:
        return True
    try:
        return mark[0].read_text(encoding="ascii") == mark[1]
    except OSError:
        return False


@contextmanager
def _mark(shared: Path | None) -> Iterator[tuple[Path, str] | None]:
    """A file in the shared directory, and what is in it."""
    if shared is None:
        yield None
        return
    text = secrets.token_hex(16)
    file = shared.absolute() / f".er-gym-{text}"
    file.write_text(text, encoding="ascii")
    try:
        yield file, text
    finally:
        file.unlink(missing_ok=True)
