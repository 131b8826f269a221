"""Saves a learner as arrays and JSON; reading the file runs no code.

``model.npz`` is NumPy's archive of arrays, read without pickle: ``policy/…`` (the weights),
``optimizer/N/…`` (Adam's state for the N-th weight), ``anchor/…`` (the weights of the policy that a
run started from) and ``about``, JSON in UTF-8 (the algorithm, its observations and its progress).
``config.yaml`` beside it holds the rest: the hyper-parameters and the shape of the network.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections import deque
from pathlib import Path
from typing import Any, cast

import gymnasium
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from agents.rl.policy_file import (
    ABOUT,
    MODEL,
    about,
    check_about,
    learner_name,
    model_errors,
    read_about,
    read_tensor,
)
from er_gym.writing import write_atomic

_COUNTERS = ("num_timesteps", "_n_updates", "_episode_num", "_n_calls", "exploration_rate")
"""The progress counters of a learner; not every algorithm has all of them."""

KEPT = "kept_by_callbacks"
"""The attribute of a learner in which callbacks keep plain data for a continued run."""
Arrays = dict[str, NDArray[Any]]


# -- writing -------------------------------------------------------------------------------------


def save(model: BaseAlgorithm, run: Path) -> None:
    """Write the model; the file is replaced as a whole."""
    told = np.frombuffer(json.dumps(_about(model)).encode(), np.uint8)
    archive = io.BytesIO()
    arrays: dict[str, Any] = {ABOUT: told, **_arrays(model)}
    np.savez(archive, **arrays)
    write_atomic(run / MODEL, archive.getvalue())


def _arrays(model: BaseAlgorithm) -> Arrays:
    """By name in the archive: the weights and the optimizer's state."""
    found = {f"policy/{name}": value for name, value in model.policy.state_dict().items()}
    for number, entries in model.policy.optimizer.state_dict()["state"].items():
        found |= {f"optimizer/{number}/{name}": value for name, value in entries.items()}
    if anchor := _anchor(model):
        found |= {f"anchor/{name}": value for name, value in anchor.state_dict().items()}
    return {name: value.detach().cpu().numpy() for name, value in found.items()}


def _anchor(model: BaseAlgorithm) -> torch.nn.Module | None:
    """The network that a learner started from, if it keeps it."""
    anchor: torch.nn.Module | None = getattr(model, "anchor", None)
    return anchor


def _about(model: BaseAlgorithm) -> dict[str, Any]:
    sees = cast(spaces.Dict, model.observation_space)
    return {
        **about(learner_name(type(model)), sees, int(cast(spaces.Discrete, model.action_space).n)),
        "counters": {name: getattr(model, name) for name in _COUNTERS if hasattr(model, name)},
        # Of the last episodes, for the means in the curve.
        "episodes": [
            {"r": float(each["r"]), "l": int(each["l"]), "t": float(each["t"])}
            for each in model.ep_info_buffer or ()
        ],
        # Of the last update; they are logged with the next rollout.
        "logged": _logged(model),
        "successes": [bool(each) for each in model.ep_success_buffer or ()],
        KEPT: getattr(model, KEPT, {}),
    }


def _logged(model: BaseAlgorithm) -> dict[str, float]:
    """What the learner has recorded and not written yet."""
    if not hasattr(model, "_logger"):  # it has not learnt
        return {}
    found = model.logger.name_to_value
    return {name: float(value) for name, value in found.items() if hasattr(value, "__float__")}


def restore_logged_values(file: Path, model: BaseAlgorithm) -> None:
    """Record in a learner's logger what a file says was recorded and not written yet.

    Raises:
        ValueError: the file is damaged.
    """
    with model_errors(file):
        with zipfile.ZipFile(file) as archive:
            logged = read_about(archive).get("logged", {})  # older files lack it
        for name, value in logged.items():
            model.logger.record(str(name), float(value))


# -- reading -------------------------------------------------------------------------------------


def restore(file: Path, model: BaseAlgorithm) -> None:
    """Load weights, optimizer state and progress of a file into an untrained learner.

    Raises:
        ValueError: the file is damaged or belongs to another learner.
    """
    with model_errors(file):
        with zipfile.ZipFile(file) as archive:
            told = read_about(archive)
            check_about(told, _about(model))
            weights = model.policy.state_dict()
            policy = {
                name: read_tensor(archive, f"policy/{name}", value)
                for name, value in weights.items()
            }
            optimizer = _optimizer(archive, model)
            if anchor := _anchor(model):
                anchor.load_state_dict(
                    {
                        name: read_tensor(archive, f"anchor/{name}", value)
                        for name, value in anchor.state_dict().items()
                    }
                )
        found: dict[str, Any] = {"policy": policy, "policy.optimizer": optimizer}
        model.set_parameters(found, device="cpu")
        for name in _COUNTERS:
            if hasattr(model, name):
                setattr(model, name, type(getattr(model, name))(told["counters"][name]))
        for name, kept in (("ep_info_buffer", "episodes"), ("ep_success_buffer", "successes")):
            setattr(model, name, deque(told[kept], maxlen=model._stats_window_size))
        setattr(model, KEPT, told.get(KEPT, {}))  # older files lack it


def _optimizer(archive: zipfile.ZipFile, model: BaseAlgorithm) -> dict[str, Any]:
    """The optimizer's state; each entry is a scalar or has its weight's shape."""
    state: dict[int, dict[str, torch.Tensor]] = {}
    weights = [each for group in model.policy.optimizer.param_groups for each in group["params"]]
    number = torch.zeros(())
    for entry in archive.namelist():
        if not entry.startswith("optimizer/"):
            continue
        place, _, name = entry.removeprefix("optimizer/").removesuffix(".npy").partition("/")
        if not place.isdecimal() or int(place) >= len(weights):
            raise ValueError(f"{entry} does not belong to a weight")
        like = number if name == "step" else weights[int(place)]
        state.setdefault(int(place), {})[name] = read_tensor(archive, entry[:-4], like)
    return {"state": state, "param_groups": model.policy.optimizer.state_dict()["param_groups"]}


# -- learners without environments ---------------------------------------------------------------


class _UnplayableEnv(gymnasium.Env[Any, Any]):
    """Has spaces but cannot be played."""

    def __init__(self, sees: spaces.Space[Any], actions: spaces.Discrete) -> None:
        self.observation_space, self.action_space = sees, actions


def placeholder_env(sees: spaces.Space[Any], actions: int, count: int) -> VecEnv:
    """Placeholder environments for a learner that only plays, or gets its environments later."""
    return DummyVecEnv([lambda: _UnplayableEnv(sees, spaces.Discrete(actions))] * count)
