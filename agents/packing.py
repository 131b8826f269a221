"""Makes a model's folder from a training run: small weights, and no file that could run code."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import load_file, save

from agents.rl.config import TrainConfig, config_file, config_names, how_learnt, load_config
from agents.rl.policy_file import (
    CONFIG,
    MODEL,
    POLICY,
    trained_steps,
    write_policy,
)
from agents.vlm.clients.merging import STAMP, merge
from agents.vlm.tuned_model import is_model_run, model_directory
from agents.zoo.card import Kind
from agents.zoo.index import CARD, MOST_BYTES, SUFFIXES, files_of
from er_gym.tasks.reading import parse_json, read_text
from er_gym.writing import check_folder, check_output, whole_folder, write_atomic

DTYPES = {"float16": torch.float16, "bfloat16": torch.bfloat16, "float32": torch.float32}
"""The types of weights in a folder, by name."""
WEIGHTS = "model.safetensors"
"""A language model's weights, in one file."""
HISTORY = "finetune_history.json"
_MODEL_CONFIGS = ("config.json", "adapter_config.json")
_PICKLES = (".bin", ".pt", ".pth", ".pkl", ".pickle", ".ckpt", ".zip", ".msgpack", ".h5")
"""Files of weights that run code when they are read, or that er-gym does not read."""


@dataclass(frozen=True)
class Packed:
    """A folder that has been filled, but for its card.

    Attributes:
        kind: of the model.
        parameters: the number of its weights.
        trained_on: what it has learnt from.
        made_by: the command that trains it again; empty where the run does not tell it.
    """

    kind: Kind
    parameters: int
    trained_on: str
    made_by: tuple[str, ...]


def pack(run: Path, folder: Path, dtype: str) -> Packed:
    """Write the files of a run's model into a folder.

    Args:
        run: a run directory of ``er-gym train-rl``, ``er-gym finetune`` or ``er-gym reinforce``, or
            a language model's directory.
        folder: where to; it must exist.
        dtype: of the weights, one of :data:`DTYPES`.

    Raises:
        ValueError: the run is not finished, holds no model, holds one that is not taken, or holds
            links; or the type does not hold its weights.
    """
    kind: Kind
    if (run / MODEL).is_file():
        kind, weights = "policy", folder / POLICY
        trained_on, made_by = _pack_policy(run, folder, dtype)
    elif is_model_run(run) or any((run / name).is_file() for name in _MODEL_CONFIGS):
        kind, weights = "language model", folder / WEIGHTS
        trained_on, made_by = _pack_language_model(run, folder, dtype), ()
    else:
        raise ValueError(
            f"{run} holds no trained model; give a run directory of er-gym train-rl or er-gym "
            "finetune"
        )
    with safe_open(weights, framework="pt") as opened:
        shapes = [opened.get_slice(name).get_shape() for name in opened.keys()]  # noqa: SIM118
    return Packed(kind, sum(map(math.prod, shapes)), trained_on, made_by)


@contextmanager
def new_folder(models: Path, name: str) -> Iterator[Path]:
    """Fill a model's folder whole or not at all; a model that is there is replaced.

    Args:
        models: the folder of all models.
        name: of the model.

    Raises:
        ValueError: the folder would hold a file that no model may have, all models together would
            be too large, or the folder holds something that is no model's.
    """
    check_folder(models / name, CARD)
    if (models / name).is_dir():
        check_output(models / name / CARD)
    models.mkdir(parents=True, exist_ok=True)
    with whole_folder(models / name, CARD) as draft:
        yield draft
        check_files(draft)
        there = {each.name: each for each in models.glob("[!.]*") if each.is_dir()}
        check_size({**there, name: draft})


def _refuse_links(folder: Path, files: Iterable[Path]) -> None:
    """What a link leads to may be no part of the model, and would be given away with it."""
    for file in files:
        if file.is_symlink():
            raise ValueError(
                f"{file} is a link to {os.readlink(file)}, and the zoo takes the files themselves: "
                f"make a copy with them, cp -rL {folder} COPY, look at it, and add that"
            )


def check_files(folder: Path) -> None:
    """Raise ValueError if a file is of a kind that no model may have."""
    for file in files_of(folder):
        if file.is_symlink() or file.suffix not in SUFFIXES:
            raise ValueError(
                f"{file.name} is no file for the zoo, which takes files ending in "
                f"{', '.join(SUFFIXES)} alone, since none of these runs code"
            )


def check_size(folders: Mapping[str, Path]) -> None:
    """Raise ValueError if the files of these folders, by name, are too large together."""
    sizes = {name: size_of(folder) for name, folder in folders.items()}
    if (total := sum(sizes.values())) > MOST_BYTES:
        raise ValueError(
            f"the models would have {total:,} bytes together, and {MOST_BYTES:,} are allowed: "
            f"{', '.join(f'{name} {size:,}' for name, size in sorted(sizes.items()))}; "
            "remove one, or give a smaller --dtype"
        )


def size_of(folder: Path) -> int:
    """The bytes of a folder's files."""
    return sum(file.stat().st_size for file in files_of(folder))


def same_files(one: Path, other: Path) -> bool:
    """Whether two folders hold the same files, the card aside, so that they play alike."""
    first, second = (
        {file.relative_to(each): file.read_bytes() for file in files_of(each) if file.name != CARD}
        for each in (one, other)
    )
    return first == second


# -- policies ------------------------------------------------------------------------------------


def _pack_policy(run: Path, folder: Path, dtype: str) -> tuple[str, tuple[str, ...]]:
    _refuse_links(run, (run / MODEL, run / CONFIG))
    config, steps = load_config(run / CONFIG), trained_steps(run)
    if steps < config.total_steps:
        raise ValueError(
            f"{run} has {steps:,} of {config.total_steps:,} steps; run er-gym train-rl again to "
            "continue it"
        )
    write_policy(run, folder, DTYPES[dtype])
    types = ", ".join(config.env.types) or "all types"
    trained_on = (
        f"{how_learnt(config, steps)}, seed {config.seed}, tasks of the suite "
        f"{config.env.episodes} ({types})"
    )
    return trained_on, _train_command(config)


def _train_command(config: TrainConfig) -> tuple[str, ...]:
    """The command with one of er-gym's own configurations; none if the run's is another."""
    for name in config_names():
        if load_config(config_file(name), (), {"seed": config.seed}) == config:
            return (f"er-gym train-rl --config {name} --seed {config.seed}",)
    return ()


# -- language models -----------------------------------------------------------------------------


def _pack_language_model(run: Path, folder: Path, dtype: str) -> str:
    source = Path(model_directory(str(run)))
    # The user may name a link; the run may not hold one.
    _refuse_links(source, (*([source] if source != run else ()), *sorted(source.rglob("*"))))
    _check_no_pickles(source)
    source = merge(source)  # an adapter into its model
    _refuse_links(source, sorted(source.rglob("*")))
    if not (source / WEIGHTS).is_file():
        raise ValueError(f"{source} has no {WEIGHTS}; the zoo takes weights in one such file")
    changes: dict[str, Callable[[Any], Any]] = {"config.json": _with_dtype, HISTORY: _placeless}
    for file in files_of(source):
        if file.name in (WEIGHTS, STAMP):
            continue
        to = folder / file.relative_to(source)
        to.parent.mkdir(parents=True, exist_ok=True)
        if change := changes.get(file.name):
            write_atomic(to, json.dumps(change(_json(file)), indent=2) + "\n")
        else:
            shutil.copyfile(file, to)
    _write_weights(source / WEIGHTS, folder / WEIGHTS, dtype)
    runs = _json(folder / HISTORY)["runs"] if (folder / HISTORY).is_file() else []
    return "; then ".join(map(_stage, runs)) or "nothing: its weights are random"


def _check_no_pickles(source: Path) -> None:
    for file in files_of(source):
        if file.suffix in _PICKLES:
            raise ValueError(
                f"{source} holds {file.name}, which may run code when it is read; the zoo takes "
                f"weights in {WEIGHTS} alone: save them so, and remove that file"
            )


def _json(file: Path) -> Any:
    return parse_json(read_text(file), file)


def _write_weights(source: Path, to: Path, dtype: str) -> None:
    try:
        weights = load_file(source)
    except (SafetensorError, OSError) as error:
        raise ValueError(f"{source} cannot be read: {error}") from error
    kept = {
        name: value.to(DTYPES[dtype]) if value.is_floating_point() else value
        for name, value in weights.items()
    }
    for name, value in kept.items():
        if not torch.isfinite(value).all() and torch.isfinite(weights[name]).all():
            raise ValueError(f"{dtype} does not hold the weights {name}; give --dtype bfloat16")
    write_atomic(to, save(kept, metadata={"format": "pt"}))


def _with_dtype(config: dict[str, Any]) -> dict[str, Any]:
    """Stored small, played as it was trained: transformers takes the type that is stated here."""
    return {"dtype": config.pop("torch_dtype", None) or "float32", **config}


def _placeless(history: dict[str, Any]) -> dict[str, Any]:
    """Without the folders of the machine that trained."""
    return {**history, "runs": [_without_place(each) for each in history["runs"]]}


def _without_place(run: Mapping[str, Any]) -> dict[str, Any]:
    names = {"run": Path(run["run"]).name, "data": [Path(each).name for each in run["data"]]}
    return {**run, **names}


def _stage(run: Mapping[str, Any]) -> str:
    stage = f"{run['stage']}: " if run["stage"] else ""
    played = "advantage" in run["settings"]  # only a reinforcement run has such a setting
    stage, on = ("reinforcement: ", "own episodes") if played else (stage, "conversations")
    return f"{stage}{run['updates']:,} updates on {run['conversations']:,} {on}"
