"""Facts about pretrained models that can be fine-tuned: a YAML file each in ``configs/models``."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from agents.configs import ConfigKind
from agents.finetune.memory import ModelDimensions, dimensions_of
from er_gym.tasks.reading import parse_json, read_text

_MOST_TIMES_LONGER = 200
"""Qwen's image processor refuses pictures with a longer side than this many times the shorter."""


class ModelFacts(BaseModel):
    """A model that other programs know.

    Attributes:
        hub: its name on the Hugging Face Hub.
        parameters: of the published weights.
        feedback_id: the first token id that the tokenizer leaves free, which ``<|feedback|>`` gets.
        programs: by program, the name under which it knows models of this build.
        config: the numbers of the model's ``config.json`` that memory and pictures depend on.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    hub: str
    parameters: int
    feedback_id: int
    programs: dict[str, str]
    config: dict[str, Any]

    @property
    def numbers(self) -> ModelDimensions:
        """The sizes that decide how much memory it takes."""
        return dimensions_of(self.config)

    @property
    def token_side(self) -> int:
        """The pixels a side of what becomes one token of a picture."""
        vision = self.config["vision_config"]
        return int(vision["patch_size"] * vision["spatial_merge_size"])

    @property
    def model_type(self) -> str:
        """Transformers' name of the build."""
        return str(self.config["model_type"])


@dataclass(frozen=True)
class ChosenModel:
    """A model and where its weights are.

    Attributes:
        name: of the file in ``configs/models``.
        facts: what the file says.
        weights: the name on the Hub, or a directory, which need not be on this machine.
    """

    name: str
    facts: ModelFacts
    weights: str


MODELS = ConfigKind(ModelFacts, "models", "model")
model_names, load_facts = MODELS.names, MODELS.load


def choose_model(text: str) -> ChosenModel:
    """The model that a user names.

    Args:
        text: a name of ``configs/models``, such as ``qwen2-vl-7b``; its name on the Hub, such as
            ``Qwen/Qwen2-VL-7B-Instruct``; ``NAME=WEIGHTS`` with weights elsewhere, such as
            ``qwen2-vl-7b=/cluster/stage1``; or a model's directory on this machine.

    Raises:
        ValueError: no model fits; the message lists the known ones.
    """
    name, equals, weights = text.partition("=")
    if name in model_names():
        if equals and not weights:
            raise ValueError(f"{text!r:.100} names no weights; give NAME or NAME=WEIGHTS")
        facts = load_facts(name)
        return ChosenModel(name, facts, weights or facts.hub)
    known = {each: load_facts(each) for each in model_names()}
    for each, facts in known.items():
        if text == facts.hub:
            return ChosenModel(each, facts, text)
    if (Path(text) / "config.json").is_file():
        return _of_directory(Path(text), known)
    raise ValueError(
        f"there is no model {text!r:.100}; give one of {', '.join(known)}, its name on the Hub, "
        "NAME=WEIGHTS for weights on another machine, or a directory with config.json"
    )


def _of_directory(directory: Path, known: dict[str, ModelFacts]) -> ChosenModel:
    file = directory / "config.json"
    config = parse_json(read_text(file), file)
    if not isinstance(config, dict):
        raise ValueError(f"{file} is no model's configuration; it holds no table")
    numbers = dimensions_of(config)
    sizes = numbers.layers, numbers.hidden
    for name, facts in known.items():
        same = facts.model_type == config.get("model_type")
        if same and sizes == (facts.numbers.layers, facts.numbers.hidden):
            return ChosenModel(name, facts, str(directory.resolve()))
    builds = sorted({facts.model_type for facts in known.values()})
    raise ValueError(
        f"{directory} holds a {config.get('model_type')} of {numbers.layers} layers, which is of "
        f"the size of none of {', '.join(known)} ({', '.join(builds)}); add it to configs/models"
    )


def picture_tokens(side: int, width: int, height: int, min_pixels: int, max_pixels: int) -> int:
    """How many tokens the language model sees for a picture.

    The rule of Qwen's image processor (``smart_resize`` of transformers): both sides become
    multiples of a token's ``side``, and the area comes between the bounds.

    Raises:
        ValueError: the picture is too thin.
    """
    if max(width, height) / min(width, height) > _MOST_TIMES_LONGER:
        raise ValueError(
            f"a picture of {width} × {height} pixels is too thin; Qwen's models take sides up to "
            f"{_MOST_TIMES_LONGER} : 1"
        )
    rows, columns = round(height / side) * side, round(width / side) * side
    if rows * columns > max_pixels:
        scale = math.sqrt(height * width / max_pixels)
        rows = max(side, math.floor(height / scale / side) * side)
        columns = max(side, math.floor(width / scale / side) * side)
    elif rows * columns < min_pixels:
        scale = math.sqrt(min_pixels / (height * width))
        rows = math.ceil(height * scale / side) * side
        columns = math.ceil(width * scale / side) * side
    return (rows // side) * (columns // side)
