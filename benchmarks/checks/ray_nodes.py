"""A Ray cluster of several nodes on this machine, whose processes can be killed."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.harness.processes import kill
from er_gym.rollout.cluster.session import LOCAL_ENVIRONMENT, auth_token, on_loopback, same_signals

_STORE_BYTES = 100 * 2**20


@dataclass
class RayNodes:
    """The nodes of a cluster.

    Attributes:
        address: for ``--ray-address``.
        environment: variables that a process needs to join it.
    """

    cluster: Any
    environment: dict[str, str]
    _others: list[Any] = field(default_factory=list)

    @property
    def address(self) -> str:
        return str(self.cluster.address)

    def add(self, cpus: float = 1) -> None:
        """Add a node."""
        with on_loopback(), same_signals():
            node = self.cluster.add_node(num_cpus=cpus, object_store_memory=_STORE_BYTES)
        self._others.append(node)

    def kill_node(self) -> None:
        """Kill the raylet of a node that is not the head, by SIGKILL."""
        kill(self._others.pop(0).all_processes["raylet"][0].process.pid)

    def kill_head(self) -> None:
        """Kill the node that knows all others, its server and its raylet, by SIGKILL."""
        for name in ("gcs_server", "raylet"):
            kill(self.cluster.head_node.all_processes[name][0].process.pid)

    def workers(self) -> list[int]:
        """The processes that work for er-gym on these nodes now; other clusters may be here."""
        nodes = self.cluster.list_all_nodes()
        raylets = {node.all_processes["raylet"][0].process.pid for node in nodes}
        return [
            int(folder.name)
            for folder in Path("/proc").iterdir()
            if folder.name.isdigit()
            and _title(folder).startswith(("ray::JobActor", "ray::EnvA"))
            and _parent(folder) in raylets
        ]


@contextlib.contextmanager
def ray_nodes(count: int, cpus: float = 1) -> Iterator[RayNodes]:
    """A cluster of ``count`` nodes with ``cpus`` processors each, on loopback alone."""
    folder = tempfile.mkdtemp(prefix="nodes-", dir="/tmp")
    environment = {**LOCAL_ENVIRONMENT, "RAY_AUTH_TOKEN": auth_token(), "RAY_TMPDIR": folder}
    os.environ.update(environment)
    Path(folder, "ray").mkdir()  # Ray writes the address there
    try:
        from ray.cluster_utils import Cluster

        with on_loopback(), same_signals():
            cluster = Cluster(
                initialize_head=True,
                head_node_args={
                    "num_cpus": cpus,
                    "include_dashboard": False,
                    "object_store_memory": _STORE_BYTES,
                },
            )
        nodes = RayNodes(cluster, environment)
        try:
            for _ in range(count - 1):
                nodes.add(cpus)
            yield nodes
        finally:
            cluster.shutdown()
    finally:
        shutil.rmtree(folder, ignore_errors=True)
        for name in environment:
            os.environ.pop(name, None)


def _title(folder: Path) -> str:
    try:
        return (folder / "cmdline").read_bytes().decode(errors="replace")
    except OSError:
        return ""


def _parent(folder: Path) -> int:
    try:
        return int((folder / "stat").read_text().rpartition(")")[2].split()[1])
    except OSError:
        return 0
