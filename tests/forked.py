"""Worker processes that fork from one that has imported what they need, as tests start hundreds.

er-gym spawns its workers, and each imports er-gym for a second, torch and transformers for five.
In the tests a worker forks from a server that has imported them once; it gets what it is given by
the same pickling. The tests of the workers themselves (tests/rollout) and of whole commands spawn.

``python -m tests.forked ladder WORDS`` is ``er-gym ladder WORDS`` whose phases are forked.
"""

from __future__ import annotations

import multiprocessing
import os
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext, ForkServerProcess
from typing import Any

from er_gym.rollout import processes

_MODULES = ("agents.expert.collect", "agents.expert.players", "er_gym.data.critic")
_MODULES_OF_PHASES = (*_MODULES, "agents.finetune.train", "agents.vlm.clients.local")


class _Process(ForkServerProcess):
    """A process with the environment variables of its starter, as a spawned one has them.

    Its own workers fork from the same server.
    """

    def __init__(self, *args: Any, **named: Any) -> None:
        super().__init__(*args, **named)
        self._variables = dict(os.environ)

    def run(self) -> None:
        os.environ.clear()
        os.environ.update(self._variables)
        processes.CONTEXT = FORKED  # type: ignore[assignment]
        # Python means to use the server that a process was forked from, and starts another.
        forkserver._forkserver.ensure_running = lambda: None  # type: ignore[attr-defined]
        super().run()


class _Context(ForkServerContext):
    Process = _Process  # type: ignore[assignment]


SPAWNED = processes.CONTEXT
FORKED = _Context()


def fork_workers(modules: tuple[str, ...] = _MODULES) -> None:
    """Let er-gym fork its workers, from a server that imports these modules."""
    multiprocessing.set_forkserver_preload(list(modules))
    processes.CONTEXT = FORKED  # type: ignore[assignment]


if __name__ == "__main__":
    from benchmarks.cli.main import main
    from benchmarks.study import run

    fork_workers(_MODULES_OF_PHASES)
    run.CONTEXT = FORKED  # type: ignore[assignment]
    main()
