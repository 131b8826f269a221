"""Takes down which arguments a trainer's own parser knows, for ``trainer_arguments.json``.

Run it in an environment in which the trainer is installed, with the file's path::

    python take_down_arguments.py llama-factory|ms-swift|trl trainer_arguments.json
"""

from __future__ import annotations

import json
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

PACKAGES = {"llama-factory": "llamafactory", "ms-swift": "ms-swift", "trl": "trl"}


def _classes(program: str) -> list[Any]:
    if program == "llama-factory":
        return list(import_module("llamafactory.hparams.parser")._TRAIN_ARGS)
    if program == "ms-swift":
        return [import_module("swift.arguments").SftArguments]
    trl = import_module("trl")
    return [trl.SFTConfig, trl.ModelConfig]


def take_down(program: str) -> dict[str, Any]:
    """The versions, and the type or the choices of each argument."""
    from transformers import HfArgumentParser

    found: dict[str, str] = {}
    for action in HfArgumentParser(_classes(program))._actions:
        if action.dest == "help" or action.nargs == 0:  # such as --no_bf16, which negates bf16
            continue
        kind = getattr(action.type, "__name__", "str").replace("string_to_bool", "bool")
        told = "|".join(map(str, action.choices)) if action.choices else kind
        found[action.dest] = f"list of {told}" if action.nargs in ("+", "*") else told
    versions = {name: version(name) for name in (PACKAGES[program], "transformers")}
    return {"versions": versions, "arguments": dict(sorted(found.items()))}


if __name__ == "__main__":
    name, file = sys.argv[1], Path(sys.argv[2])
    known = json.loads(file.read_text()) if file.exists() else {}
    known[name] = take_down(name)
    file.write_text(json.dumps(dict(sorted(known.items())), indent=1) + "\n")
