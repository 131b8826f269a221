"""The files of a trained policy, as far as playing needs them: no learner, no optimizer.

A run directory of ``er-gym train-rl`` holds ``model.npz`` (:mod:`agents.rl.model_file`), a model of
the zoo ``policy.safetensors``, which has nothing but the network's weights and a little JSON. Both
are read without running code. ``config.yaml`` beside them says how the network is made. Only torch
is needed for this.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from gymnasium import spaces
from numpy.lib import format as npy
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save

from agents.configs import dump
from agents.rl.config import TrainConfig, load_config
from agents.rl.network import TypeNetwork
from agents.rl.policy_observation import IMAGES, PolicyObservation
from er_gym.envs.actions import ACTIONS
from er_gym.writing import YAML_MARK, write_atomic

CONFIG = "config.yaml"
MODEL = "model.npz"
POLICY = "policy.safetensors"
"""The model file of the zoo: the weights of the network that chooses the actions."""
FORMAT = 1
ABOUT = "about"
"""What a file says of itself: the array of that name, or safetensors' metadata of that name."""
_HEADER = 4096
"""The largest header of an array in the archive, in bytes."""
_LONGEST_ABOUT = 1_000_000

Weights = dict[str, torch.Tensor]


class Learner(NamedTuple):
    """What playing has to know of an algorithm's learner.

    Attributes:
        name: of its class.
        network: the beginning of the names of the weights that choose actions.
        needs_mask: whether the observation of the learner holds the action mask.
    """

    name: str
    network: str
    needs_mask: bool


LEARNERS = {
    "ppo": Learner("MaskablePPO", "features_extractor.network.", needs_mask=False),
    "dqn": Learner("LegalDQN", "q_net.network.", needs_mask=True),
    "qrdqn": Learner("LegalQRDQN", "quantile_net.network.", needs_mask=True),
}


def learner_name(kind: type) -> str:
    """The name of a learner's class in files; one that extends it plays alike."""
    known = {learner.name for learner in LEARNERS.values()}
    return next(each.__name__ for each in kind.__mro__ if each.__name__ in known)


def policy_file(path: Path) -> Path:
    """The model file of a run directory or of a model of the zoo; or the file itself.

    Raises:
        ValueError: there is none.
    """
    for file in (path, path / MODEL, path / POLICY):
        if file.is_file() and file.name in (MODEL, POLICY):
            return file
    if path.suffix == ".zip" and path.is_file():
        raise ValueError(
            f"{path} is a zip file, as Stable-Baselines3 writes, and reading one can run code; "
            f"give rl: and a directory with {MODEL}, which er-gym train-rl makes"
        )
    raise ValueError(
        f"there is no trained model {path / MODEL}; give rl: and a directory that er-gym train-rl "
        "has made"
    )


# -- reading -------------------------------------------------------------------------------------


def load_network(file: Path) -> TypeNetwork:
    """The network of a model file that chooses the actions, with the ``config.yaml`` beside it.

    Args:
        file: ``model.npz`` or ``policy.safetensors``.

    Raises:
        ValueError: the file cannot be read or belongs to another learner.
    """
    config = load_config(file.parent / CONFIG)
    network = untrained_network(config)
    read = _read_safetensors if file.name == POLICY else _read_archive
    with model_errors(file):
        told, weights = read(file, config, network.state_dict())
        check_about(told, _about(config))
        network.load_state_dict(weights)
    return network.eval()


@contextmanager
def model_errors(file: Path) -> Iterator[None]:
    """Raise ValueError for whatever reading a damaged model file raises."""
    try:
        yield
    # zipfile, numpy and torch raise these for files that are damaged, cut short, encrypted,
    # compressed in a way unknown here, or that hold other arrays. NotImplementedError is zipfile's
    # for the compression, EOFError for a file cut short; SafetensorError is safetensors' for all;
    # AttributeError comes of JSON that is no table.
    except (
        zipfile.BadZipFile, OSError, KeyError, TypeError, ValueError, RuntimeError, MemoryError,
        NotImplementedError, EOFError, SafetensorError, AttributeError,
    ) as error:  # fmt: skip
        why = " ".join(str(error).split()) or type(error).__name__
        raise ValueError(f"{file} cannot be read as a model: {why}") from error


def check_about(told: Mapping[str, Any], wanted: Mapping[str, Any]) -> None:
    """Raise ValueError if a file's learner is another than is wanted."""
    for name in ("format", "algorithm", "sees", "actions"):
        if told[name] != wanted[name]:
            raise ValueError(
                f"its {name} is {told[name]}, and {wanted[name]} is needed here; use the er-gym "
                "that it was trained with, or train again"
            )


def read_about(archive: zipfile.ZipFile) -> Any:
    """The metadata of ``model.npz``."""
    return json.loads(read_array(archive, ABOUT, _LONGEST_ABOUT).tobytes().decode())


def read_array(archive: zipfile.ZipFile, name: str, most: int) -> NDArray[Any]:
    """Read an array of at most ``most`` bytes."""
    entry = archive.getinfo(f"{name}.npy")
    if entry.file_size > most + _HEADER:
        raise ValueError(f"{name} is larger than its weight")
    with archive.open(entry) as stream:
        return npy.read_array(stream, allow_pickle=False)


def read_tensor(archive: zipfile.ZipFile, name: str, like: torch.Tensor) -> torch.Tensor:
    """Read an array that has the shape and type of a tensor."""
    array = read_array(archive, name, like.numel() * like.element_size())
    wanted = like.detach().cpu().numpy()
    if array.shape != wanted.shape or array.dtype != wanted.dtype:
        raise ValueError(
            f"{name} is {array.dtype} {array.shape}, and {wanted.dtype} {wanted.shape} is needed"
        )
    return torch.from_numpy(array)


def _read_archive(
    file: Path, config: TrainConfig, like: Mapping[str, torch.Tensor]
) -> tuple[Any, Weights]:
    start = LEARNERS[config.algorithm.name].network
    with zipfile.ZipFile(file) as archive:
        told = read_about(archive)
        check_about(told, _about(config))  # before an array's shape is found to be another
        return told, {
            name: read_tensor(archive, f"policy/{start}{name}", value)
            for name, value in like.items()
        }


def _read_safetensors(
    file: Path, config: TrainConfig, like: Mapping[str, torch.Tensor]
) -> tuple[Any, Weights]:
    with safe_open(file, framework="pt") as opened:
        told = json.loads((opened.metadata() or {})[ABOUT])
        return told, {name: opened.get_tensor(name) for name in opened.keys()}  # noqa: SIM118


def untrained_network(config: TrainConfig) -> TypeNetwork:
    """The network of a run before it has learnt anything."""
    outputs = config.algorithm.quantiles if config.algorithm.name == "qrdqn" else 1
    space = channels_first(PolicyObservation(config.env).space)
    return TypeNetwork(space, **config.network.model_dump(), outputs=outputs)


def channels_first(space: spaces.Dict) -> spaces.Dict:
    """The space with pictures as the network sees them: (channels, height, width)."""
    boxes = dict(space.spaces)
    for name in IMAGES.keys() & boxes.keys():
        height, width, channels = boxes[name].shape or ()
        boxes[name] = spaces.Box(0, 255, (channels, height, width), np.uint8)
    return spaces.Dict(boxes)


def about(algorithm: str, sees: spaces.Dict, actions: int) -> dict[str, Any]:
    """What a file states about the learner whose weights it holds."""
    return {
        "format": FORMAT,
        "algorithm": algorithm,
        "sees": {name: list(box.shape or ()) for name, box in sees.spaces.items()},
        "actions": actions,
    }


def _about(config: TrainConfig) -> dict[str, Any]:
    learner = LEARNERS[config.algorithm.name]
    space = PolicyObservation(config.env, learner.needs_mask).space
    return about(learner.name, channels_first(space), len(ACTIONS))


# -- writing -------------------------------------------------------------------------------------


def trained_steps(run: Path) -> int:
    """The number of environment steps in ``model.npz``.

    Raises:
        ValueError: the file cannot be read.
    """
    with model_errors(run / MODEL), zipfile.ZipFile(run / MODEL) as archive:
        return int(read_about(archive)["counters"]["num_timesteps"])


def write_policy(run: Path, folder: Path, dtype: torch.dtype) -> None:
    """Write ``policy.safetensors`` and ``config.yaml`` of a run into a folder.

    Args:
        run: a run directory of ``er-gym train-rl``.
        folder: where to; it must exist.
        dtype: of the written weights. Playing turns them back into float32.

    Raises:
        ValueError: the run holds no ``model.npz``, or it cannot be read.
    """
    config = load_config(run / CONFIG)
    network = load_network(run / MODEL)
    weights = {name: value.to(dtype).contiguous() for name, value in network.state_dict().items()}
    told = {ABOUT: json.dumps(_about(config))}
    write_atomic(folder / POLICY, save(weights, metadata=told))
    write_atomic(folder / CONFIG, YAML_MARK + dump(config))
