"""The architecture of a model with random weights. Imports no model library.

er-gym's own files are ``configs/architectures/NAME.yaml``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field

from agents.configs import ConfigKind

Family: TypeAlias = Literal["llama", "qwen2", "qwen3", "qwen2_vl", "qwen2_5_vl", "qwen3_vl"]
"""Architectures of transformers, by ``model_type``."""
BYTES = 256


class Architecture(BaseModel):
    """A model's architecture, and the size of its vocabulary.

    Attributes:
        description: for people.
        family: the architecture.
        vocabulary: how many tokens the tokenizer learns, bytes included, special tokens not. With
            256, each byte is a token.
        text, vision: the fields of the language model's and the vision tower's configuration, with
            transformers' names. ``vision`` is for the families with vision.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    description: str = ""
    family: Family
    vocabulary: Annotated[int, Field(ge=BYTES, le=1_000_000)] = 4096
    text: Mapping[str, Any]
    vision: Mapping[str, Any] = {}

    @property
    def sees(self) -> bool:
        """Whether the model takes pictures."""
        return self.family.endswith("_vl")


load_architecture = ConfigKind(Architecture, "architectures", "architecture").load
