"""Whoever poisons a collection is found by ``er-gym data verify``; what nobody touched is not."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from tamperings import TAMPERINGS, Loot
from verified import problems

from benchmarks.cli.main import cli
from er_gym.rollout import worker_backend
from er_gym.tasks.suites import load_suite

TASKS = load_suite("mini").tasks
RECIPE = Path(__file__).with_name("collected.yaml")


def collect(out: Path, *more: object) -> Path:
    """Run ``er-gym collect`` in this process."""

    def run_here(make: Any, jobs: Iterable[Any], **how: Any) -> Iterator[tuple[Any, Any]]:
        worker = make()
        yield from ((job, worker(job)) for job in jobs)
        worker.close()

    words = ("collect", "--suite", "mini", "--workers", "1", "--out", out, *more)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(worker_backend, "run_jobs", run_here)
        told = CliRunner().invoke(cli, [str(word) for word in words], standalone_mode=False)
    assert told.exception is None, told.output
    assert told.return_value == 0, told.output
    return out


@pytest.fixture(scope="module")
def collected(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("collected") / "x"
    return collect(out, "--recipe", RECIPE, "--width", "96", "--height", "54")


def test_what_nobody_touched_comes_out_again(collected: Path) -> None:
    assert problems(collected, TASKS) == []
    assert problems(collected, TASKS, pictures=False) == []


def test_every_tampering_is_found(collected: Path, tmp_path: Path) -> None:
    """Each on a copy that holds nothing but the changed trajectory."""
    missed = []
    for name, tamper in TAMPERINGS.items():
        copy = tmp_path / "x"
        shutil.copytree(collected, copy)
        loot = Loot.of(copy)
        loot.write(tamper(loot))
        if not problems(copy, TASKS):
            missed.append(name)
        shutil.rmtree(copy)
    assert not missed
    assert len(TAMPERINGS) >= 30
