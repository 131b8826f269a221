"""Worker processes that fork from one that has imported what they need, as tests start hundreds.

er-gym spawns its workers, and each imports er-gym for a second, torch and transformers for five.
In the tests a worker forks from a server that has imported them once; it gets what it is given by
the same pickling. The tests of the workers themselves (tests/rollout) and of whole commands spawn.

:func:`start_er_gym` runs a study, whose phases fork, too.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
from collections.abc import Sequence
from multiprocessing import forkserver
from multiprocessing.context import ForkServerContext, ForkServerProcess
from pathlib import Path
from typing import Any
from unittest import mock

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
        gc.freeze()  # no search for cycles among what the server has imported
        super().run()


class _Context(ForkServerContext):
    Process = _Process  # type: ignore[assignment]


SPAWNED = processes.CONTEXT
FORKED = _Context()
_PHASES = forkserver.ForkServer()  # type: ignore[attr-defined]


def fork_workers(modules: tuple[str, ...] = _MODULES) -> None:
    """Let er-gym fork its workers, from a server that imports these modules."""
    multiprocessing.set_forkserver_preload(list(modules))
    processes.CONTEXT = FORKED  # type: ignore[assignment]


def start_er_gym(words: Sequence[str], said: Path) -> ForkServerProcess:
    """Start ``er-gym WORDS`` in a process whose phases, and their workers, fork from one server.

    All that it starts so in a session forks from the same one, which imports torch once.

    Args:
        words: of the command.
        said: the file to which its outputs are added.
    """
    _PHASES.set_forkserver_preload([*_MODULES_OF_PHASES])
    process = FORKED.Process(target=_er_gym, args=(tuple(words), said))
    with mock.patch.object(forkserver, "connect_to_new_process", _PHASES.connect_to_new_process):
        process.start()
    return process


def _er_gym(words: Sequence[str], said: Path) -> None:
    from benchmarks.cli.main import main
    from benchmarks.study import run

    with said.open("ab") as file:
        for descriptor in (1, 2):
            os.dup2(file.fileno(), descriptor)
    run.CONTEXT = FORKED  # type: ignore[assignment]
    main(words)
