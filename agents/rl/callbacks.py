"""Training callbacks: checkpoints, learning curve, evaluation, curriculum."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import torch
from sb3_contrib.common.maskable.callbacks import MaskableEvalCallback
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import KVWriter, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecEnv
from torch.utils.tensorboard import SummaryWriter

from agents.rl.guidance import Phase
from agents.rl.model_file import save
from er_gym.tasks.reading import read_bytes
from er_gym.writing import write_atomic

CURVE = "curve.jsonl"


class BetweenRollouts(BaseCallback):
    """A callback that does nothing at a single step."""

    def _on_step(self) -> bool:
        return True


class Checkpoints(BetweenRollouts):
    """Saves the model every ``every`` steps, between an update and the next rollout.

    Attributes:
        steps: the number of steps when a rollout last began or ended. A saved model counts as one
            of this many steps, since a partial rollout is lost with the process.
    """

    def __init__(self, run: Path, every: int) -> None:
        super().__init__()
        self._run, self._every = run, every
        self.steps = 0

    def save(self) -> None:
        """Save now."""
        self.model.num_timesteps = self.steps
        self._save()

    def _save(self) -> None:
        save(self.model, self._run)
        for writer in self.model.logger.output_formats:
            if isinstance(writer, TrackerWriter):
                writer.saved(self.steps)

    def _on_training_start(self) -> None:
        self.steps = self._saved_at = self.num_timesteps

    def _on_rollout_start(self) -> None:
        self.steps = self.num_timesteps
        if self.steps - self._saved_at >= self._every:
            self._save()
            self._saved_at = self.steps

    def _on_rollout_end(self) -> None:
        self.steps = self.num_timesteps


class CurveWriter(KVWriter):
    """Writes each logger dump as a line of ``curve.jsonl``, with steps and seconds.

    Args:
        run: the run directory.
        steps: of the checkpoint from which the run goes on, and the lines after it are dropped;
            None for a run that begins.
    """

    def __init__(self, run: Path, steps: int | None) -> None:
        self._file = run / CURVE
        kept = read_curve(run) if steps is not None else []
        kept = [line for line in kept if steps is not None and line["steps"] <= steps]
        write_atomic(self._file, "".join(json.dumps(line) + "\n" for line in kept))
        self._before = kept[-1]["seconds"] if kept else 0.0
        self._began = time.monotonic()

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, Any], step: int = 0
    ) -> None:
        """Append a line."""
        line = {"steps": step, "seconds": round(self._before + time.monotonic() - self._began, 1)}
        line |= {key: float(value) for key, value in key_values.items() if _is_number(value)}
        with self._file.open("a") as file:
            file.write(json.dumps(line) + "\n")

    def close(self) -> None:
        """Nothing to do: each line is written at once."""


class TensorBoardWriter(TensorBoardOutputFormat):
    """Writes each logger dump for TensorBoard.

    Args:
        folder: of its files.
        steps: as :class:`CurveWriter` takes it. What was logged after these is void: TensorBoard
            drops it, as for a fine-tuning run.
    """

    def __init__(self, folder: Path, steps: int | None) -> None:
        if steps is None:
            shutil.rmtree(folder, ignore_errors=True)
        self.writer = SummaryWriter(str(folder), purge_step=0 if steps is None else steps + 1)
        self._is_closed = False


class TrackerWriter(KVWriter):
    """Sends each logger dump to a tracker that takes a step once, when a checkpoint holds it.

    A run that was killed repeats the steps after its last checkpoint. Values that a tracker has got
    cannot be removed, unlike lines of ``curve.jsonl``. So values are sent only once a checkpoint
    covers their step.

    Args:
        send: takes values and the number of steps.
        first: the least number of steps that the tracker does not have.
        before: the lines of an earlier start of the run, up to its checkpoint.
    """

    def __init__(
        self,
        send: Callable[[dict[str, float], int], None],
        first: int,
        before: Sequence[Mapping[str, float]],
    ) -> None:
        self._send = send
        self._waiting = [dict(line) for line in before if line["steps"] >= first]
        self.saved(max((int(line["steps"]) for line in before), default=-1))

    def write(
        self, key_values: dict[str, Any], key_excluded: dict[str, Any], step: int = 0
    ) -> None:
        """Keep the values until a checkpoint holds them."""
        values = {key: float(value) for key, value in key_values.items() if _is_number(value)}
        self._waiting.append({**values, "steps": step})

    def saved(self, steps: int) -> None:
        """A checkpoint of so many steps is on the disk."""
        ready = [line for line in self._waiting if line["steps"] <= steps]
        self._waiting = [line for line in self._waiting if line["steps"] > steps]
        for line in ready:
            self._send({key: line[key] for key in line if key != "steps"}, int(line["steps"]))

    def close(self) -> None:
        """Send the rest: the run is over."""
        self.saved(max((int(line["steps"]) for line in self._waiting), default=-1))


def _is_number(value: object) -> bool:
    return hasattr(value, "__float__")


def read_curve(run: Path) -> list[dict[str, float]]:
    """The lines of a run's curve; a half-written line is skipped."""
    file = run / CURVE
    lines = []
    for text in read_bytes(file).split(b"\n") if file.exists() else ():
        try:
            line = json.loads(text)
        except ValueError:  # not JSON, or not even text
            continue
        if isinstance(line, dict) and "steps" in line and "seconds" in line:
            lines.append(line)
    return lines


def evaluated_at(run: Path, steps: int) -> int:
    """The number of steps at the last evaluation up to a checkpoint; 0 without any."""
    found = (
        int(line["steps"])
        for line in read_curve(run)
        if line["steps"] <= steps and any(name.startswith("eval/") for name in line)
    )
    return max(found, default=0)


class HeldOutEvaluation(MaskableEvalCallback):
    """sb3-contrib's evaluation every ``every`` steps, between rollouts, rather than by calls.

    Args:
        before: the number of steps at the last evaluation of an earlier start, so that one that
            was due when the run was killed is done.
    """

    def __init__(self, env: Any, every: int, count: int, seed: int, before: int = 0) -> None:
        super().__init__(env, n_eval_episodes=count, eval_freq=1, verbose=0, warn=False)
        self._every, self._seed, self._evaluated_at = every, seed, before

    def _on_rollout_start(self) -> None:
        if self.num_timesteps - self._evaluated_at >= self._every:
            self.evaluate()

    def _on_step(self) -> bool:
        return True

    def evaluate(self) -> None:
        """Evaluate now, on the same episodes every time."""
        self._evaluated_at = self.num_timesteps
        self.eval_env.seed(self._seed)
        # The values of the last update wait for the next rollout; written now, they would stand at
        # a step that has those of the update before.
        log = self.logger
        waiting: tuple[dict[str, Any], ...] = (
            log.name_to_value, log.name_to_count, log.name_to_excluded
        )  # fmt: skip
        kept = [dict(each) for each in waiting]
        for each in waiting:
            each.clear()
        super()._on_step()
        for each, values in zip(waiting, kept, strict=True):
            each.update(values)


class TorchThreads(BetweenRollouts):
    """Gives torch ``threads`` threads for updates and one during rollouts, which need the cores."""

    def __init__(self, threads: int) -> None:
        super().__init__()
        self._threads = threads

    def _on_rollout_start(self) -> None:
        torch.set_num_threads(1)

    def _on_rollout_end(self) -> None:
        torch.set_num_threads(self._threads)


class Curriculum(BetweenRollouts):
    """Sets the task types of the current phase in the environments."""

    def __init__(self, phases: Sequence[Phase], types: Sequence[str]) -> None:
        super().__init__()
        self._phases, self._after = phases, tuple(types)
        self._now: tuple[str, ...] | None = None

    def set_types(self, env: VecEnv, steps: int) -> None:
        """Set the task types for episodes that begin after ``steps`` steps."""
        types = next((phase.types for phase in self._phases if steps < phase.until), self._after)
        if types != self._now:
            self._now = types
            env.env_method("set_types", types)

    def _on_rollout_start(self) -> None:
        self.set_types(self.training_env, self.num_timesteps)


class SuccessByType(BaseCallback):
    """Logs the success rate of each task type over its last ``over`` episodes.

    Episodes that started near their goal are left out: they are easier.
    """

    def __init__(self, over: int = 100) -> None:
        super().__init__()
        self._over = over
        self._last: dict[str, list[bool]] = {}
        self._played: set[str] = set()

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "is_success" in info and not info.get("started_at"):
                self._note(info)
        return True

    def _on_rollout_start(self) -> None:
        self._played.clear()

    def _note(self, info: Mapping[str, Any]) -> None:
        self._played.add(info["task_type"])
        last = self._last.setdefault(info["task_type"], [])
        last.append(info["is_success"])
        del last[: -self._over]

    def _on_rollout_end(self) -> None:
        for name in sorted(self._played):
            successes = self._last[name]
            self.logger.record(f"success/{name}", sum(successes) / len(successes))
