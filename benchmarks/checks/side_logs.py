"""Kills runs again and again, and looks at what they log beside their results.

    python -m benchmarks.checks.side_logs [TRIES]

Each try plays ``er-gym bench --track tensorboard`` or trains with ``er-gym train-rl`` in an empty
folder. SIGKILL ends it at points of its progress that are drawn by the try's number; then the same
command goes on to the end. TensorBoard must have each step of each figure once and none missing,
as ``curve.jsonl`` must; the last success of a benchmark run must be that of its report. Prints the
failures. The exit code is 1 if there is one.
"""

from __future__ import annotations

import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from random import Random

from agents.rl.callbacks import read_curve
from benchmarks.harness.processes import ER_GYM
from benchmarks.harness.tally import Tally, run_check, tally
from benchmarks.scoring.report import load_run, slices
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.events import read_events

_TRIES, _KILLS = 6, 3
_ROLLOUT, _ROLLOUTS = 128, 12
_TYPES = "single_search"


@dataclass(frozen=True)
class _Kind:
    """A command that is killed.

    Attributes:
        options: of the command, without ``--out``.
        most: its progress at the end.
        progress: how far a run is.
        problems: what is wrong with the logs of one that has ended.
    """

    options: tuple[str, ...]
    most: int
    progress: Callable[[Path], int]
    problems: Callable[[Path], Iterator[str]]


def _results(run: Path) -> int:
    return sum(1 for _ in read_events(run, ["episode_ended"]))


def _rollouts(run: Path) -> int:
    return len(read_curve(run))


def _steps(run: Path) -> dict[str, list[int]]:
    """The steps of each figure in TensorBoard's logs, in order."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(run / "tensorboard"))
    found.Reload()
    return {name: [event.step for event in found.Scalars(name)] for name in found.Tags()["scalars"]}


def _of_bench(run: Path) -> Iterator[str]:
    steps, wanted = _steps(run), [*range(1, _results(run) + 1)]
    for name in ("success", "crashed"):
        if steps.get(name) != wanted:
            yield f"{name} has the steps {steps.get(name)}, not {wanted}"
    (summary,) = (each for level, _, each in slices(load_run(run).scores[CORRECTED.name])
                  if level == "overall")  # fmt: skip
    if summary.n != len(wanted):
        yield f"there are {summary.n} records and {len(wanted)} results in the stream"


def _of_training(run: Path) -> Iterator[str]:
    curve, wanted = read_curve(run), [_ROLLOUT * n for n in range(1, _ROLLOUTS + 1)]
    board = _steps(run)
    for name, expected in (("rollout/success_rate", wanted), ("train/loss", wanted[1:])):
        lines = [int(line["steps"]) for line in curve if name in line]
        for where, found in (("curve.jsonl", lines), ("TensorBoard", board.get(name))):
            if found != expected:
                yield f"{where}: {name} has the steps {found}, not {expected}"
    for name, found in board.items():
        if any(a >= b for a, b in pairwise(found)):
            yield f"TensorBoard: {name} has the steps {found}"


_SETTINGS = (
    f"env.types=[{_TYPES}]", "env.episodes=mini", f"total_steps={_ROLLOUT * _ROLLOUTS}",
    f"checkpoint_every={2 * _ROLLOUT}", "vec.envs=2", "vec.workers=1", "evaluation=null",
    f"algorithm.n_steps={_ROLLOUT // 2}", "algorithm.batch_size=64", "warm_start=null",
)  # fmt: skip
_KINDS = (
    _Kind(
        ("bench", "--suite", "mini", "--types", _TYPES, "--agent", "random", "--workers", "2",
         "--track", "tensorboard"),
        12, _results, _of_bench,
    ),
    _Kind(
        ("train-rl", "--config", "single_search", *(
            word for setting in _SETTINGS for word in ("--set", setting))),
        _ROLLOUTS, _rollouts, _of_training,
    ),
)  # fmt: skip


def check(tries: Sequence[str] = ()) -> Tally:
    """Try all kinds in turn, so often in all; print the failures."""
    numbers = range(int(tries[0]) if tries else _TRIES)
    return tally(
        "runs killed", ((f"try {n}", _problems(n, _KINDS[n % len(_KINDS)])) for n in numbers)
    )


def _problems(number: int, kind: _Kind) -> Iterator[str]:
    random = Random(number)
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        command = [*ER_GYM, *kind.options, "--out", str(run)]
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        for point in sorted(random.sample(range(1, kind.most), _KILLS)):
            with subprocess.Popen(command, **silent) as process:  # type: ignore[call-overload]
                while kind.progress(run) < point and process.poll() is None:
                    time.sleep(0.002)
                time.sleep(random.uniform(0, 0.1))
                process.send_signal(signal.SIGKILL)
        ended = subprocess.run(command, capture_output=True, text=True, check=False)
        if ended.returncode:
            yield f"{kind.options[0]} ended with {ended.returncode}: {ended.stderr[-300:]}"
        else:
            yield from kind.problems(run)


if __name__ == "__main__":
    run_check(check, __doc__)
