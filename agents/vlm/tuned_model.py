"""The directory of a fine-tuned model: where its files are, and how it was taught to converse."""

from __future__ import annotations

from pathlib import Path

RUN = "finetune.json"
MODEL = "model"
AGENT = "agent.yaml"
"""In a model's directory: settings of a model agent, such as the prompts that it was tuned on."""


def model_directory(path: str) -> str:
    """The directory of a model, given it or the run of ``er-gym finetune`` that made it.

    Any other path, or a model's name on a hub, stays as it is.

    Raises:
        ValueError: the run is not finished.
    """
    run = Path(path)
    if not (run / RUN).is_file():
        return path
    if not (run / MODEL).is_dir():
        raise ValueError(
            f"{path} is a fine-tuning run that is not finished, so it has no model yet; run its "
            "command again until it is"
        )
    return str(run / MODEL)


def agent_file(path: str) -> Path | None:
    """The file with the settings that a model was tuned for; None if its directory has none.

    Args:
        path: as :func:`model_directory` takes it.

    Raises:
        ValueError: the run is not finished.
    """
    file = Path(model_directory(path)) / AGENT
    return file if file.is_file() else None
