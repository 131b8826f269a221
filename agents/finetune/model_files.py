"""Reads a model directory before fine-tuning: everything but the weights.

A model directory is what ``save_pretrained`` writes, a whole model or an adapter, with tokenizer,
chat template and, for pictures, the image processor. Those that er-gym trained have two files more:

- ``agent.yaml``: the form of the training conversations, as settings of a model agent;
- ``finetune_history.json``: the runs in which it was trained.
"""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import transformers
import yaml
from pydantic import BaseModel, ConfigDict, ValidationError

from agents.finetune.settings import Stage
from agents.vlm.clients.adapters import base_directory
from agents.vlm.clients.checkpoint import error_summary
from agents.vlm.clients.checkpoint import template_of as template_of_files
from agents.vlm.tuned_model import AGENT, model_directory
from er_gym.tasks.reading import read_bytes, read_yaml
from er_gym.writing import YAML_MARK, write_atomic

HISTORY = "finetune_history.json"
_WEIGHTS = (".safetensors", ".bin")
_BLOCK = 1 << 16
_PROCESSOR = (
    "preprocessor_config.json",
    "processor_config.json",
    "video_preprocessor_config.json",
    "chat_template.json",
    "chat_template.jinja",
    "additional_chat_templates",
)
"""Files of a processor beside the tokenizer's; the template may be the processor's."""


class StageRecord(BaseModel):
    """A fine-tuning run in which a model was trained.

    Attributes:
        stage: the paper's stage; None for a run outside them.
        run: the run directory, as it was given.
        data: the data's directories; ``data_digest``: of their conversations.
        settings: of the run.
        conversations, updates: counts.
        loss: the last that was logged.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stage: Stage | None
    run: str
    data: list[str]
    data_digest: str
    settings: dict[str, Any]
    conversations: int
    updates: int
    loss: float


class History(BaseModel):
    """All fine-tuning runs in which a model was trained, the first one first."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/finetune-history/1"] = "er-gym/finetune-history/1"
    runs: tuple[StageRecord, ...] = ()

    @property
    def stages(self) -> tuple[Stage, ...]:
        """The paper's stages among them."""
        return tuple(each.stage for each in self.runs if each.stage is not None)


@dataclass(frozen=True)
class ModelFiles:
    """A model directory.

    Attributes:
        path: the directory, absolute.
        base: the directory of the whole model: the same, or that beneath its adapters.
        config: the model's configuration.
        tokenizer: the model's.
        template: the chat template.
        image_processor: None for a model that sees nothing.
        history: what it has been through.
        agent: its ``agent.yaml``, empty if it has none.
    """

    path: Path
    base: Path
    config: Any
    tokenizer: Any
    template: str
    image_processor: Any
    history: History
    agent: Mapping[str, Any]

    @property
    def has_vision(self) -> bool:
        """Whether the model sees pictures."""
        return self.image_processor is not None

    @property
    def digest(self) -> str:
        """sha256 in hex of the small files, and of samples of the weights' files."""
        told = hashlib.sha256()
        for folder in dict.fromkeys((self.path, self.base)):
            for file in sorted(folder.iterdir()):
                if file.is_file() and file.suffix in (".json", ".jinja", ".txt", *_WEIGHTS):
                    told.update(file.name.encode())
                    told.update(_sampled(file))
        return told.hexdigest()


def open_model(path: Path) -> ModelFiles:
    """Open a model directory, or the model of a finished fine-tuning run.

    Raises:
        ValueError: it is no model that can be fine-tuned; the message says what it lacks.
    """
    if not path.is_dir():
        raise ValueError(f"{path} is not a directory; give one with a model in it, or a run of "
                         "er-gym finetune")  # fmt: skip
    path = Path(model_directory(str(path))).resolve()
    base = base_directory(path)
    if not (base / "config.json").is_file():
        raise ValueError(f"{base} has no config.json, so it is no model; give a directory that "
                         "save_pretrained wrote")  # fmt: skip
    here: dict[str, Any] = {"local_files_only": True}
    try:
        config = transformers.AutoConfig.from_pretrained(base, **here)
        where = path if (path / "tokenizer_config.json").is_file() else base
        tokenizer = transformers.AutoTokenizer.from_pretrained(where, **here)
    except Exception as error:  # what broken files make of the libraries can be any exception
        raise ValueError(
            f"{path}: its config or tokenizer cannot be loaded: {error_summary(error)}"
        ) from None
    template = template_of_files(str(where)) or tokenizer.chat_template
    if not isinstance(template, str):
        raise ValueError(
            f"{path} has no chat template, so it cannot hold a conversation; give an instruct "
            "model, or put a chat_template.jinja beside it"
        )
    return ModelFiles(
        path, base, config, tokenizer, template, _image_processor(path, base, config),
        _history(path), _agent(path),
    )  # fmt: skip


def _image_processor(path: Path, base: Path, config: Any) -> Any:
    if getattr(config, "vision_config", None) is None:
        return None
    try:
        # With Pillow, as the agent does: the same pixels, and no need of torchvision.
        folder = path if (path / "preprocessor_config.json").is_file() else base
        found = transformers.AutoImageProcessor.from_pretrained(
            folder, backend="pil", local_files_only=True
        )
    except Exception as error:
        raise ValueError(
            f"{path} has no image processor that can be loaded, though the model has vision: "
            f"{error_summary(error)}; put its preprocessor_config.json beside it"
        ) from None
    if not (hasattr(found, "merge_size") and hasattr(config, "image_token_id")):
        raise ValueError(
            f"{path} does not process pictures as Qwen's models do ({type(found).__name__}), and "
            "er-gym fine-tunes no others; give a Qwen2-VL, Qwen2.5-VL or Qwen3-VL"
        )
    return found


def _history(path: Path) -> History:
    if not (path / HISTORY).is_file():
        return History()
    try:
        return History.model_validate_json(read_bytes(path / HISTORY))
    except ValidationError as error:
        raise ValueError(f"{path / HISTORY} is damaged: {error_summary(error)}") from None


def _agent(path: Path) -> Mapping[str, Any]:
    found = read_yaml(path / AGENT) if (path / AGENT).is_file() else {}
    if not isinstance(found, dict):
        raise ValueError(f"{path / AGENT} is no table of settings; remove it or put it right")
    return found


def check_stage(files: ModelFiles, after: Stage | None) -> None:
    """Raise ValueError if the model was not trained in a stage that must come before."""
    been = files.history.stages
    if after is not None and after not in been:
        raise ValueError(
            f"this stage comes after {after}, and {files.path} has been through "
            f"{', '.join(been) or 'no stage'}; give --model the run of that stage, or "
            "--set after=null to start from any model"
        )


def check_prompts(files: ModelFiles, prompts: Mapping[str, str]) -> None:
    """Raise ValueError if the model was tuned on another dialect or language than the data's."""
    known = files.agent.get("prompts")
    if isinstance(known, dict):
        for name, wanted in prompts.items():
            if name in known and known[name] != wanted:
                raise ValueError(
                    f"{files.path} was taught with {name} {known[name]}, and the data is in "
                    f"{name} {wanted}; set data.{name}={known[name]}, or remove {AGENT} from the "
                    "model's directory to teach it anew"
                )


def write_agent_files(
    folder: Path, history: History, agent: Mapping[str, Any], processor_of: ModelFiles
) -> None:
    """Write what makes weights a model that can be played: processor, template, agent, history."""
    for name in _PROCESSOR:
        for source in (processor_of.path, processor_of.base):
            if (source / name).is_file() and not (folder / name).exists():
                shutil.copyfile(source / name, folder / name)
    _write_bounds(folder, agent.get("pictures", {}))
    words = yaml.safe_dump(dict(agent), sort_keys=False, allow_unicode=True)
    write_atomic(folder / AGENT, YAML_MARK + words)
    write_atomic(folder / HISTORY, history.model_dump_json(indent=2) + "\n")


def _write_bounds(folder: Path, pictures: Mapping[str, Any]) -> None:
    """Let the image processor scale pictures as in the training, whatever program loads it."""
    least, most = pictures.get("model_min_pixels"), pictures.get("model_max_pixels")
    for name in ("preprocessor_config.json", "processor_config.json"):
        if least is None or most is None or not (folder / name).is_file():
            continue
        told = json.loads(read_bytes(folder / name))
        found = told.get("image_processor") if name == "processor_config.json" else told
        if isinstance(found, dict):
            found.pop("min_pixels", None)
            found.pop("max_pixels", None)
            found["size"] = {"shortest_edge": least, "longest_edge": most}
            write_atomic(folder / name, json.dumps(told, indent=2) + "\n")


def settings_as_json(settings: BaseModel) -> dict[str, Any]:
    """Settings as they stand in files."""
    return dict(json.loads(settings.model_dump_json()))


def _sampled(file: Path) -> bytes:
    """A digest of a file: of all of it, or of its size and 64 blocks if it is large."""
    told, size = hashlib.sha256(), file.stat().st_size
    told.update(str(size).encode())
    with file.open("rb") as opened:
        for start in range(0, size, max(_BLOCK, size // 64)):
            opened.seek(start)
            told.update(opened.read(_BLOCK))
    return told.digest()
