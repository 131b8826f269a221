"""The directory of a fine-tuned model: where its files are, and the prompts it was tuned on."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

RUN, REINFORCED = "finetune.json", "reinforce.json"
_RUNS = {RUN: "fine-tuning run", REINFORCED: "reinforcement run"}
"""What makes a model is known by a file in its directory."""
MODEL = "model"
AGENT = "agent.yaml"
"""In a model's directory: settings of a model agent, such as the prompts that it was tuned on."""


_AS_DRAWN = 1 << 24
"""Pixels; no drawn picture has more."""


def is_model_run(folder: Path) -> bool:
    """Whether a directory is that of a run that trains a language model."""
    return any((folder / name).is_file() for name in _RUNS)


def model_directory(path: str) -> str:
    """The directory of a model, given it or the run of ``er-gym finetune`` or ``er-gym reinforce``
    that made it.

    Any other path, or a model's name on a hub, stays as it is.

    Raises:
        ValueError: the run is not finished.
    """
    run = Path(path)
    noun = next((noun for name, noun in _RUNS.items() if (run / name).is_file()), None)
    if noun is None:
        return path
    if not (run / MODEL).is_dir():
        raise ValueError(
            f"{path} is a {noun} that is not finished, so it has no model yet; run its "
            "command again until it is"
        )
    return str(run / MODEL)


def named_model(path: str) -> str:
    """The directory of a model as :func:`model_directory` has it, or the model's name on a hub.

    Raises:
        ValueError: the run is not finished, or the path is no name and no directory.
    """
    path = model_directory(path)
    if not Path(path).is_dir() and (path.startswith(("/", ".", "~")) or path.count("/") > 1):
        raise ValueError(
            f"there is no directory {path}; give one with a model in it, or a model's name on the "
            "Hugging Face hub"
        )
    return path


def agent_file(path: str) -> Path | None:
    """The file with the settings that a model was tuned for; None if its directory has none.

    Args:
        path: as :func:`model_directory` takes it.

    Raises:
        ValueError: the run is not finished.
    """
    file = Path(model_directory(path)) / AGENT
    return file if file.is_file() else None


def recorded_pictures(
    collection: Mapping[str, Any], min_pixels: int, max_pixels: int
) -> dict[str, Any]:
    """The settings with which an agent is shown pictures as training files have them.

    Args:
        collection: the settings in the collection's manifest.
        min_pixels, max_pixels: the bounds to which the model scaled them when it was tuned.

    Returns:
        fields of :class:`agents.vlm.settings.Pictures`.
    """
    stated, env = collection.get("pictures") or {}, collection.get("env", {})
    return {
        **{name: stated[name] for name in ("format", "quality") if name in stated},
        **{name: env[name] for name in ("width", "height") if name in env},
        "min_pixels": 1,  # a collection keeps pictures as they are drawn
        "max_pixels": _AS_DRAWN,
        "model_min_pixels": min_pixels,
        "model_max_pixels": max_pixels,
    }
