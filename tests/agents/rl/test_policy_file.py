"""A policy plays from its network's weights alone, as its learner would."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file
from untrained_policy import write_untrained_run

from agents.rl.agent import GreedyPolicy, RLAgent
from agents.rl.config import TrainConfig
from agents.rl.policy_file import (
    ABOUT,
    CONFIG,
    LEARNERS,
    MODEL,
    POLICY,
    load_network,
    trained_steps,
    write_policy,
)
from agents.rl.policy_observation import PolicyObservation
from er_gym.envs.actions import INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import load_suite

Make = Callable[..., TrainConfig]
MINI = load_suite("mini").tasks
PICTURES = {
    "episodes": "mini", "obs_mode": "rgb+depth+state", "width": 48, "height": 36,
    "frames": 2, "instruction": "hashed",
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, make_config: Make) -> Path:
    path = tmp_path_factory.mktemp("rl") / "run"
    write_untrained_run(make_config(), path)
    return path


@pytest.mark.parametrize("algorithm", ["ppo", "dqn", "qrdqn"])
@pytest.mark.parametrize("env", [{"episodes": "mini"}, PICTURES], ids=["state", "pictures"])
def test_it_chooses_what_its_learner_chooses(
    tmp_path: Path, make_config: Make, algorithm: str, env: dict[str, Any]
) -> None:
    settings = {"name": algorithm} if algorithm == "ppo" else {"name": algorithm, "buffer_size": 9}
    config = make_config(algorithm=settings, env=env)
    learner = write_untrained_run(config, tmp_path)
    policy = GreedyPolicy.load(tmp_path / MODEL)
    needs_mask = LEARNERS[algorithm].needs_mask
    observation = PolicyObservation(config.env)
    room = EmbodiedEnv((), obs_mode=config.env.obs_mode, width=48, height=36)
    obs, info = room.reset(seed=0, options={"task": MINI[3]})
    seen = observation.reset(obs, info, MINI[3].instruction)
    for _ in range(2):
        mask = info["action_mask"].copy()
        while mask.sum() > 1:  # the best, the second best …
            action = policy.best(seen, mask)
            assert mask[action]
            if needs_mask:
                best, _ = learner.predict({**seen, "mask": mask}, deterministic=True)
            else:
                best, _ = learner.predict(seen, deterministic=True, action_masks=mask)
            assert action == int(best)
            mask[action] = 0
        obs, _, _, _, info = room.step(f"navigate to {room.details['navigable'][0]}")
        seen = observation.observe(obs, info)
    room.close()


def test_weights_of_half_the_size_play_from_a_folder_of_their_own(
    run: Path, tmp_path: Path
) -> None:
    write_policy(run, tmp_path, torch.float16)
    assert sorted(file.name for file in tmp_path.iterdir()) == [CONFIG, POLICY]
    kept, whole = load_file(tmp_path / POLICY), load_network(run / MODEL).state_dict()
    assert {each.dtype for each in kept.values()} == {torch.float16}
    assert kept.keys() == whole.keys()
    for name, value in load_network(tmp_path / POLICY).state_dict().items():
        assert value.dtype == torch.float32
        torch.testing.assert_close(value, whole[name], rtol=1e-3, atol=1e-4)
    agent = RLAgent(tmp_path)
    room = EmbodiedEnv((), obs_mode=agent.obs_mode)
    obs, info = room.reset(seed=0, options={"task": MINI[0]})
    agent.reset(MINI[0], obs, info)
    assert info["action_mask"][INDEX[agent.act(obs, info).action]]
    room.close()


def test_a_run_tells_its_steps(run: Path, tmp_path: Path) -> None:
    assert trained_steps(run) == 512
    with pytest.raises(ValueError, match=r"model.npz cannot be read as a model"):
        trained_steps(tmp_path)


def test_playing_imports_neither_the_learners_nor_their_environments(run: Path) -> None:
    program = (
        "import sys; from agents import make_agent; "
        f"make_agent('rl:{run}'); print(*(m for m in sys.modules if 'baselines3' in m or "
        "m.startswith('sb3')))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, ""), done.stderr


def changed(folder: Path, about: dict[str, Any] | None = None, **weights: Any) -> None:
    """Write the policy again with another word about it, or other weights."""
    told = {"format": 1, "algorithm": "MaskablePPO", "sees": {"state": [2259]}, "actions": 286}
    found = {**load_file(folder / POLICY), **weights}
    save_file(
        {name: value for name, value in found.items() if value is not None},
        folder / POLICY,
        metadata={ABOUT: json.dumps({**told, **(about or {})})},
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda file: changed(file.parent, {"actions": 7}), "its actions is 7, and 286 is needed"),
        (lambda file: changed(file.parent, {"algorithm": "LegalDQN"}), "its algorithm is LegalDQN"),
        (lambda file: changed(file.parent, kinds=torch.zeros(3)), "size mismatch for kinds"),
        (lambda file: changed(file.parent, kinds=None), "Missing key.*kinds"),
        (lambda file: changed(file.parent, more=torch.zeros(3)), "Unexpected key.*more"),
        (lambda file: save_file({"kinds": torch.zeros(3)}, file), "about"),
        (lambda file: file.write_bytes(b"\x80\x04"), "header"),
        (lambda file: file.write_bytes(b""), "header"),
    ],
)
def test_a_changed_policy_is_one_clear_error(
    run: Path, tmp_path: Path, change: Callable[[Path], Any], message: str
) -> None:
    write_policy(run, tmp_path, torch.float16)
    load_network(tmp_path / POLICY)
    change(tmp_path / POLICY)
    with pytest.raises(ValueError, match=rf"(?i){POLICY} cannot be read as a model: .*{message}"):
        load_network(tmp_path / POLICY)


def test_an_archive_of_other_weights_is_one_clear_error(run: Path, tmp_path: Path) -> None:
    copied = shutil.copytree(run, tmp_path / "copied")
    with np.load(copied / MODEL) as found:
        arrays = dict(found)
    arrays["policy/features_extractor.network.kinds"] = np.zeros(3, np.float32)
    np.savez(copied / MODEL, **arrays)
    with pytest.raises(ValueError, match=rf"{MODEL} cannot be read as a model: .* is needed"):
        load_network(copied / MODEL)
