"""Training runs learn, continue, and end after the requested number of steps."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from stable_baselines3.common.callbacks import BaseCallback

from agents.configs import dump
from agents.rl.callbacks import TrackerWriter, read_curve
from agents.rl.config import TrainConfig
from agents.rl.policy_file import MODEL, read_about
from agents.rl.train import load_last_checkpoint, train
from benchmarks.cli.main import cli
from er_gym.locking import Locked, exclusive_use
from er_gym.resumable import FolderConflict

Make = Callable[..., TrainConfig]
ROOT = Path(__file__).resolve().parents[3]


class Returns(BaseCallback):
    """Keeps the return of every episode, and the actions of every step."""

    def __init__(self) -> None:
        super().__init__()
        self.returns: list[float] = []
        self.actions: list[int] = []

    def _on_step(self) -> bool:
        self.actions += self.locals["actions"].ravel().tolist()
        self.returns += [info["episode"]["r"] for info in self.locals["infos"] if "episode" in info]
        return True


class Interrupt(BaseCallback):
    """Presses Ctrl-C after so many steps."""

    def __init__(self, after: int) -> None:
        super().__init__()
        self.after = after

    def _on_step(self) -> bool:
        if self.num_timesteps >= self.after:
            raise KeyboardInterrupt
        return True


def weights(model: Any) -> list[np.ndarray]:
    return [value.numpy() for value in model.policy.state_dict().values()]


def test_the_return_rises(make_config: Make, tmp_path: Path) -> None:
    """A few thousand steps are enough by far to find out what is worth something."""
    config = make_config(
        total_steps=8192,
        vec={"envs": 16, "workers": 2},
        algorithm={"n_steps": 64, "batch_size": 256, "n_epochs": 4, "learning_rate": 3e-3},
        env={"episodes": "mini", "types": ["single_toggle"], "max_steps": 12},
    )
    seen = Returns()
    train(config, tmp_path / "run", more=(seen,))
    fifth = len(seen.returns) // 5
    before, after = np.mean(seen.returns[:fifth]), np.mean(seen.returns[-fifth:])
    assert after > before + 0.2


def test_a_seed_gives_the_same_policy_again(make_config: Make, tmp_path: Path) -> None:
    runs, played = [], []
    for number, seed in enumerate((3, 3, 4)):
        seen = Returns()
        config = make_config(seed=seed, total_steps=512)
        runs.append(weights(train(config, tmp_path / str(number), more=(seen,))))
        played.append(seen.actions)
    assert played[0] == played[1] != played[2]
    assert all((one == other).all() for one, other in zip(runs[0], runs[1], strict=True))


def test_the_run_directory(make_config: Make, tmp_path: Path) -> None:
    run = tmp_path / "run"
    config = make_config(
        evaluation={"episodes": "mini", "every": 256, "count": 4}, tensorboard=True
    )
    model = train(config, run)
    assert model.num_timesteps == 512
    assert np.array([5e-324]) * 1.0 > 0  # arithmetic is as it was before
    assert {file.name for file in run.iterdir()} == {
        "config.yaml", "curve.jsonl", "model.npz", "tensorboard"
    }  # fmt: skip
    curve = read_curve(run)
    assert [line["steps"] for line in curve] == sorted(line["steps"] for line in curve)
    assert curve[-1]["steps"] == 512
    assert 0 <= curve[-1]["eval/success_rate"] <= 1
    assert any("success/single_pickup" in line for line in curve)
    assert list((run / "tensorboard").iterdir())


def test_more_steps_continue_a_run_and_a_complete_run_does_nothing(
    make_config: Make, tmp_path: Path
) -> None:
    run = tmp_path / "run"
    train(make_config(total_steps=512), run)
    assert train(make_config(total_steps=1024), run).num_timesteps == 1024
    saved = (run / MODEL).stat().st_mtime_ns
    assert train(make_config(total_steps=1024), run).num_timesteps == 1024
    assert (run / MODEL).stat().st_mtime_ns == saved
    assert [line["steps"] for line in read_curve(run)] == [256, 512, 768, 1024]


def test_another_kind_of_folder_is_left_alone(make_config: Make, tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text("{}")
    with pytest.raises(
        FolderConflict, match=r"is a run \(it holds run\.json\); choose another --out"
    ):
        train(make_config(), tmp_path)
    assert [each.name for each in tmp_path.iterdir()] == ["run.json"]


def test_another_configuration_is_refused(make_config: Make, tmp_path: Path) -> None:
    run = tmp_path / "run"
    train(make_config(), run)
    with pytest.raises(FolderConflict, match=r"its seed is 0, this one's 1; choose another --out"):
        train(make_config(seed=1), run)


def test_ctrl_c_loses_no_more_than_a_rollout(make_config: Make, tmp_path: Path) -> None:
    run = tmp_path / "run"
    config = make_config(total_steps=1024)
    with pytest.raises(KeyboardInterrupt):
        train(config, run, more=(Interrupt(700),))
    model = load_last_checkpoint(run)
    assert model is not None
    assert model.num_timesteps == 512
    assert train(config, run).num_timesteps == 1024


def test_a_damaged_model_is_one_clear_error(make_config: Make, tmp_path: Path) -> None:
    run = tmp_path / "run"
    train(make_config(), run)
    (run / MODEL).write_bytes(b"PK")
    with pytest.raises(ValueError, match=r"model.npz cannot be read as a model"):
        load_last_checkpoint(run)


def test_a_curriculum_takes_the_types_in_turn(make_config: Make, tmp_path: Path) -> None:
    config = make_config(
        total_steps=768,
        env={"episodes": "mini", "types": ["single_pickup"], "max_steps": 4},
        curriculum=[{"until": 300, "types": ["single_toggle"]}],
    )
    kinds: list[tuple[int, str]] = []

    class Kinds(BaseCallback):
        def _on_step(self) -> bool:
            kinds.extend(
                (self.num_timesteps, info["task_type"])
                for info in self.locals["infos"]
                if "task_type" in info
            )
            return True

    train(config, tmp_path / "run", more=(Kinds(),))
    # Those under way when the types change are played to their end.
    assert {kind for steps, kind in kinds if steps < 500} == {"single_toggle"}
    assert {kind for steps, kind in kinds if steps > 560} == {"single_pickup"}


def test_it_learns_from_pictures_and_the_sentence(make_config: Make, tmp_path: Path) -> None:
    config = make_config(
        total_steps=32,
        vec={"envs": 2, "workers": 1},
        algorithm={"name": "ppo", "n_steps": 16, "batch_size": 16},
        env={
            "episodes": "mini",
            "types": ["single_toggle"],
            "obs_mode": "rgb+state",
            "width": 48,
            "height": 27,
            "frames": 2,
            "instruction": "hashed",
            "shaping": 0.5,
        },
    )
    run = tmp_path / "run"
    model = train(config, run)
    assert model.observation_space["rgb"].shape == (6, 27, 48)  # SB3 has channels first
    assert model.observation_space["instruction"].shape == (64,)
    again = load_last_checkpoint(run)
    assert all((a == b).all() for a, b in zip(weights(model), weights(again), strict=True))


def _saved_steps(run: Path) -> int:
    """The number of steps of a run's checkpoint; 0 without one."""
    if not (run / MODEL).exists():
        return 0
    with zipfile.ZipFile(run / MODEL) as archive:
        return int(read_about(archive)["counters"]["num_timesteps"])


@pytest.mark.filterwarnings("ignore::tqdm.TqdmExperimentalWarning")
def test_after_a_sigkill_the_logs_are_those_of_an_unbroken_run(
    make_config: Make, tmp_path: Path
) -> None:
    """Killed past its checkpoint: no step is there twice, and none is lost."""
    file, run = tmp_path / "small.yaml", tmp_path / "run"
    config = make_config(
        total_steps=10**6, checkpoint_every=512, tensorboard=True,
        evaluation={"episodes": "mini", "every": 512, "count": 1},
    )  # fmt: skip
    file.write_text(dump(config))
    command = [
        sys.executable, "-m", "benchmarks.cli", "train-rl", "--config", str(file), "--out", str(run)
    ]  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ) as first:
        while True:  # until it stands still past a checkpoint: what it did since is void
            first.send_signal(signal.SIGSTOP)
            saved = _saved_steps(run)
            if saved and any(line["steps"] > saved for line in read_curve(run)):
                break
            first.send_signal(signal.SIGCONT)
            assert first.poll() is None
            time.sleep(0.05)
        first.send_signal(signal.SIGKILL)
    file.write_text(dump(config.model_copy(update={"total_steps": saved + 512})))
    again = CliRunner().invoke(cli, command[3:], standalone_mode=False)
    assert again.exception is None, again.exception
    assert again.return_value in (0, None), again.output
    assert f"{saved + 512:,} steps" in again.output
    assert _saved_steps(run) == saved + 512
    assert load_last_checkpoint(run) is not None

    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    board = EventAccumulator(str(run / "tensorboard"))
    board.Reload()
    rollouts = [*range(256, saved + 513, 256)]
    for name, wanted in (
        ("rollout/success_rate", rollouts),
        ("train/loss", rollouts[1:]),  # an update is logged with the next rollout
        ("eval/success_rate", rollouts[1::2]),
    ):
        assert _steps_of(name, read_curve(run)) == wanted, name
        assert [each.step for each in board.Scalars(name)] == wanted, name


def _steps_of(name: str, curve: list[dict[str, float]]) -> list[float]:
    return [line["steps"] for line in curve if name in line]


def test_a_tracker_that_cannot_forget_hears_of_a_step_once_and_when_it_is_certain() -> None:
    sent: list[tuple[int, dict[str, float]]] = []
    before = [{"steps": 256, "seconds": 1.0, "a": 0.1}, {"steps": 512, "seconds": 2.0, "a": 0.2}]
    # Killed after the checkpoint of step 512 and before that was sent.
    writer = TrackerWriter(lambda values, steps: sent.append((steps, values)), 257, before)
    assert [steps for steps, _ in sent] == [512]
    writer.write({"a": 0.3, "words": "no number"}, {}, 768)
    writer.write({"a": 0.4}, {}, 1024)
    assert len(sent) == 1
    writer.saved(768)
    writer.saved(768)
    assert sent[1:] == [(768, {"a": 0.3})]
    writer.close()
    assert [steps for steps, _ in sent] == [512, 768, 1024]


def test_two_do_not_train_in_one_directory(make_config: Make, tmp_path: Path) -> None:
    run = tmp_path / "run"
    with exclusive_use(run), pytest.raises(Locked, match="in use by process"):
        train(make_config(), run)
    assert not run.exists()


def test_a_start_that_fails_leaves_nothing(make_config: Make, tmp_path: Path) -> None:
    """So that the corrected command can have the directory."""
    run = tmp_path / "run"
    (run / "notes").mkdir(parents=True)
    with pytest.raises(ValueError, match="nowhere"):
        train(make_config(env={"episodes": "nowhere.jsonl"}), run)
    assert [path.name for path in run.iterdir()] == ["notes"]
