"""Merges an adapter into its model, for servers that take whole models only."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from agents.vlm.tuned_model import MODEL, RUN
from er_gym.writing import whole_folder, write_atomic

STAMP = "merged_from.json"
"""The file that says what a model was merged from."""
_COPIED = {".json", ".jinja", ".txt", ".model", ".yaml"}
_NOT_COPIED = ("adapter", "config.json", "model.safetensors", "pytorch_model")
"""The beginnings of the names of files that are an adapter's own or that come with the weights."""


def merged_directory(directory: Path) -> Path:
    """Where the whole model is that an adapter makes of its base: ``RUN/merged`` for the adapter of
    a fine-tuning run, and ``merged`` in any other adapter's directory. A whole model's directory is
    its own answer."""
    from agents.vlm.clients.adapters import is_adapter

    if not is_adapter(directory):
        return directory
    of_run = directory.name == MODEL and (directory.parent / RUN).is_file()
    return (directory.parent if of_run else directory) / "merged"


def merge(directory: Path) -> Path:
    """Merge an adapter into its model, unless that has been done.

    The result appears as a whole or not at all. It has the adapter's tokenizer and the files beside
    it, ``agent.yaml`` too, and is made again when the adapter or its base has changed.

    Args:
        directory: of an adapter, or of a whole model, which stays as it is.

    Returns:
        the directory of the whole model (:func:`merged_directory`).

    Raises:
        ValueError: the adapter or its base cannot be loaded, the disk cannot be written, or
            something else is in the whole model's place.
    """
    from agents.vlm.clients.adapters import adapter_chain

    target = merged_directory(directory)
    if target == directory:
        return directory
    base, adapters = adapter_chain(directory)
    stamp = json.dumps([_files(each) for each in (base, *adapters)])
    if (target / STAMP).is_file() and (target / STAMP).read_text(encoding="utf-8") == stamp:
        return target
    try:
        with whole_folder(target, STAMP) as draft:
            for source in (base, *adapters):  # what an adapter brings counts
                for file in source.iterdir():
                    if file.suffix in _COPIED and not file.name.startswith(_NOT_COPIED):
                        shutil.copyfile(file, draft / file.name)
            _merged(base, adapters).save_pretrained(draft)
            write_atomic(draft / STAMP, stamp)
    except OSError as error:
        raise ValueError(f"{target} cannot be written: {error.strerror or error}") from None
    return target


def _merged(base: Path, adapters: tuple[Path, ...]) -> Any:
    """The model with its adapters in its weights."""
    import transformers

    from agents.vlm.clients.adapters import with_adapter
    from agents.vlm.clients.checkpoint import error_summary, load_weights

    try:
        config = transformers.AutoConfig.from_pretrained(base, local_files_only=True)
        model, _ = load_weights(base, config, dtype="auto", local_files_only=True)
        for adapter in adapters:
            model = with_adapter(model, adapter, merge=True)
    except Exception as error:  # what broken files make of the libraries can be any exception
        raise ValueError(
            f"{adapters[-1]} cannot be merged into {base}: {error_summary(error)}"
        ) from None
    return model


def _files(directory: Path) -> list[list[Any]]:
    """Path, size and modification time of the files of a model or an adapter."""
    files = sorted(each.resolve() for each in directory.iterdir() if each.is_file())
    return [[str(each), each.stat().st_size, each.stat().st_mtime_ns] for each in files]
