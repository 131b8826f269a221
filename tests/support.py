"""Helpers that tests of several packages use for their cases."""

from __future__ import annotations

import functools
import inspect
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from er_gym.tasks.task import KeyAction, Task, type_of_id
from er_gym.tasks.types import task_type

ROOT = Path(__file__).resolve().parents[1]
Play = Callable[..., list[dict[str, Any]]]
"""Plays texts in a task: the infos of reset and of each step, with reward, ended and cut."""


def in_one_test(
    name: str, values: Iterable[Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """``pytest.mark.parametrize`` for data: one test, whose argument takes each value in turn.

    Every value is tried, and the failure names all those that failed, each with its error. Use it
    where a case takes microseconds, so that a test of its own would cost more than what it checks.
    """
    cases = list(values)
    if not cases:
        raise ValueError(f"no values for {name}: a test of nothing cannot fail")

    def decorate(check: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(check)
        def test(**fixtures: Any) -> None:
            failed: dict[int, Exception] = {}
            for index, case in enumerate(cases):
                try:
                    check(**fixtures, **{name: case})
                except Exception as error:
                    failed[index] = error
            if failed:
                told = "\n".join(
                    f"{name}={cases[index]!r}: {type(error).__name__}: {error}"
                    for index, error in failed.items()
                )
                raise AssertionError(
                    f"{len(failed)} of {len(cases)} cases failed\n{told}"
                ) from next(iter(failed.values()))

        wanted = inspect.signature(check).parameters
        kept = [wanted[each] for each in wanted if each != name]
        test.__signature__ = inspect.Signature(kept)  # type: ignore[attr-defined]
        return test

    return decorate


def run_python(
    program: str, *arguments: str, **environment: str
) -> subprocess.CompletedProcess[str]:
    """Run a program in another process, in the checkout, with more environment variables."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=220,  # of a busy machine
    )
    assert done.returncode == 0, done.stderr
    return done


def lines_until_killed(program: str, path: Path, count: int) -> list[str]:
    """The first lines that a program prints about a path; it is killed after the last of them."""
    command = [sys.executable, "-c", program, str(path)]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = list(islice(process.stdout, count))
        process.send_signal(signal.SIGKILL)
    return lines


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Torch's threads would wait for each other where tests share cores."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def with_ids(task: Task, changed: Callable[[str], str]) -> Task:
    """The task with other ids of its key actions' and its own objects."""

    def all_changed(ids: Iterable[str]) -> tuple[str, ...]:
        return tuple(map(changed, ids))

    keys = tuple(
        replace(
            key,
            object_id=changed(key.object_id),
            related_objects=all_changed(key.related_objects),
        )
        for key in task.key_actions
    )
    return replace(
        task,
        key_actions=keys,
        target_objects=all_changed(task.target_objects),
        related_objects=all_changed(task.related_objects),
    )


def make_task(
    kind: str,
    *key_actions: tuple[str, str],
    instruction: str = "Do it.",
    scene: str = "FloorPlan1",
    **fields: Any,
) -> Task:
    """A task with key actions given as (verb, object id)."""
    keys = tuple(
        KeyAction(verb, object_id, type_of_id(object_id)) for verb, object_id in key_actions
    )
    return Task("test", task_type(kind), scene, instruction, (*keys, KeyAction("end")), **fields)


def no_directory(folder: Path) -> Path:
    return folder / "none" / "here"


def empty_directory(folder: Path) -> Path:
    return folder


def damaged_model(folder: Path) -> Path:
    (folder / "modules.json").write_text("[{", encoding="utf-8")
    return folder


NO_MODELS = (no_directory, empty_directory, damaged_model)
"""Each makes, in a folder, what is no model of sentence-transformers."""
