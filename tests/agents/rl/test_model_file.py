"""Model files are weights and JSON. No file that could run code is read."""

from __future__ import annotations

import io
import json
import pickle
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from agents import make_agent
from agents.rl.config import TrainConfig
from agents.rl.policy_file import MODEL
from agents.rl.train import load_last_checkpoint, train
from benchmarks.cli.main import cli

Make = Callable[..., TrainConfig]
SMALL = {"vec": {"envs": 2, "workers": 1}, "algorithm": {"name": "ppo", "n_steps": 16}}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, make_config: Make) -> Path:
    path = tmp_path_factory.mktemp("rl") / "run"
    train(make_config(total_steps=64, **SMALL), path)
    return path


@pytest.fixture
def copied(run: Path, tmp_path: Path) -> Path:
    return shutil.copytree(run, tmp_path / "copied")


class Writes:
    """Unpickled, it writes a file."""

    def __init__(self, file: Path) -> None:
        self.file = file

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.write_text, (self.file, "ran")


def test_a_zip_of_stable_baselines_is_refused_unread(copied: Path, tmp_path: Path) -> None:
    file = copied / "model.zip"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("data", pickle.dumps(Writes(copied / "written")))
    bench = ["bench", "--suite", "mini", "--limit", "1", "--agent", f"rl:{file}"]
    result = CliRunner().invoke(cli, [*bench, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2, result.output
    assert "reading one can run code; give rl: and a directory with model.npz" in result.output
    (copied / MODEL).unlink()
    with pytest.raises(ValueError, match="there is no trained model"):
        make_agent(f"rl:{copied}")
    assert load_last_checkpoint(copied) is None
    assert not (copied / "written").exists()
    assert not (tmp_path / "out").exists()


def test_a_run_goes_on_from_all_that_it_was(run: Path) -> None:
    one, other = load_last_checkpoint(run), load_last_checkpoint(run)
    for model in (one, other):
        assert (model.num_timesteps, model._n_updates) == (64, 2)
        assert model.policy.optimizer.state_dict()["state"][0]["step"] > 0
    for mine, its in zip(one.policy.parameters(), other.policy.parameters(), strict=True):
        assert (mine == its).all()
    assert list(one.ep_success_buffer) == list(other.ep_success_buffer)


def arrays(run: Path) -> dict[str, Any]:
    with np.load(run / MODEL) as found:
        return dict(found)


def about(run: Path, **changes: Any) -> np.ndarray:
    told = {**json.loads(arrays(run)["about"].tobytes()), **changes}
    return np.frombuffer(json.dumps(told).encode(), np.uint8)


def pickled(run: Path) -> np.ndarray:
    return np.array([Writes(run / "written")], dtype=object)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        (lambda run: {"about": pickled(run)}, "Object arrays cannot be loaded"),
        (lambda run: {"policy/value_net.0.bias": pickled(run)}, "Object arrays cannot be loaded"),
        (lambda run: {"policy/value_net.0.bias": np.zeros(3, np.float32)}, r"\(16,\) is needed"),
        (lambda run: {"policy/value_net.0.bias": np.zeros(10**6)}, "larger than its weight"),
        (
            lambda run: {"optimizer/99/exp_avg": np.zeros(3, np.float32)},
            "does not belong to a weight",
        ),
        (lambda run: {"about": about(run, actions=7)}, "its actions is 7, and 286 is needed"),
        (lambda run: {"about": about(run, counters={})}, "num_timesteps"),
        (lambda run: {"about": np.zeros(5, np.uint8)}, "Expecting value"),
    ],
)
def test_a_changed_file_is_one_clear_error(
    copied: Path, changed: Callable[[Path], dict[str, Any]], message: str
) -> None:
    np.savez(copied / MODEL, **{**arrays(copied), **changed(copied)})
    with pytest.raises(ValueError, match=rf"{MODEL} cannot be read as a model: .*{message}"):
        load_last_checkpoint(copied)
    assert not (copied / "written").exists()


def test_a_pickle_under_the_name_of_ours_is_refused(copied: Path) -> None:
    for content in (pickle.dumps(Writes(copied / "written")), b"", b"PK", _npy(pickled(copied))):
        (copied / MODEL).write_bytes(content)
        with pytest.raises(ValueError, match="cannot be read as a model"):
            load_last_checkpoint(copied)
    assert not (copied / "written").exists()


def _npy(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()
