"""How much memory a fine-tuning run needs, worked out from a model's configuration alone.

Nothing is loaded. :func:`shape_of` reads what ``config.json`` says of a Qwen-VL model, or of a
language model of Llama's build; :func:`estimate` adds up what lies on one GPU:

- weights, gradients and the optimizer's states, by the usual mixed precision: a weight that learns
  takes 2 bytes, its gradient 2, and AdamW 12 (a float32 copy and two moments); a frozen weight
  takes 2. Adapters, and all that learns beside them, are kept in float32: 4 + 4 + 8 bytes. ZeRO-3
  divides all of it among the GPUs (Rajbhandari et al., arXiv 1910.02054);
- activations: with checkpointing the input of every layer and the inside of one layer, without it
  the inside of every layer (as in Korthikanti et al., arXiv 2205.05198, for attention that keeps no
  matrix of scores);
- the logits, once in bfloat16 and in float32, with a gradient: for long conversations and large
  vocabularies this is the largest part.

The sum lacks what the CUDA context and fragmentation take; :data:`OVERHEAD` stands for them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

GIB = 1024**3
OVERHEAD = 2 * GIB
"""The CUDA context, communication buffers and fragmentation: a guess, not a measurement."""
_HALF, _FULL = 2, 4
_ADAM = 8
"""Bytes a weight of AdamW's two moments in float32."""
_LOGITS = _HALF + _FULL + _FULL
"""Bytes for each logit: bfloat16, float32, and the gradient in float32."""
_VISION_INSIDE = 8
"""How many values of the hidden size a layer of the vision tower holds for each patch."""


@dataclass(frozen=True)
class VisionShape:
    """The vision tower and its projector.

    Attributes:
        layers, hidden, intermediate: of the tower. ``gated``: whether its MLP has three matrices.
        patch, temporal, merge: pixels a side of a patch, frames a patch, and patches a side that
            become one token of the language model.
        out: the language model's hidden size.
        rms: whether its norms have no bias.
        mergers: projectors beside the last, each after a layer inside (Qwen3-VL's DeepStack).
        positions: learnt position embeddings; 0 for none. ``patch_bias``: of the embedding.
    """

    layers: int
    hidden: int
    intermediate: int
    gated: bool
    patch: int
    temporal: int
    merge: int
    out: int
    rms: bool
    mergers: int = 0
    positions: int = 0
    patch_bias: bool = False

    @property
    def tower(self) -> int:
        """The parameters of the tower."""
        h, i = self.hidden, self.intermediate
        mlp = 3 * h * i + 2 * i + h if self.gated else 2 * h * i + i + h
        norms = 2 * h if self.rms else 4 * h
        layer = 4 * h * h + 4 * h + mlp + norms
        embedding = 3 * self.temporal * self.patch**2 * h + (h if self.patch_bias else 0)
        return self.layers * layer + embedding + self.positions * h

    @property
    def projector(self) -> int:
        """The parameters of the projectors: a norm and two matrices each."""
        wide = self.hidden * self.merge**2
        matrices = wide * wide + wide + wide * self.out + self.out
        norm = self.hidden if self.rms else 2 * self.hidden
        return matrices + norm + self.mergers * (matrices + 2 * wide)


@dataclass(frozen=True)
class ModelShape:
    """The sizes of a model that decide how much memory it takes.

    Attributes:
        layers, hidden, intermediate, heads, kv_heads, head_dim: of the language model.
        vocabulary: rows of the embedding.
        tied: whether the output matrix is the embedding.
        attention_bias: whether queries, keys and values have a bias; ``query_norms``: whether
            queries and keys are normalised.
        vision: None for a language model.
    """

    layers: int
    hidden: int
    intermediate: int
    heads: int
    kv_heads: int
    head_dim: int
    vocabulary: int
    tied: bool
    attention_bias: bool = False
    query_norms: bool = False
    vision: VisionShape | None = None

    @property
    def language(self) -> int:
        """The parameters of the language model's layers and its last norm."""
        h, d = self.hidden, self.head_dim
        queries, keys = self.heads * d, self.kv_heads * d
        attention = 2 * h * queries + 2 * h * keys
        attention += queries + 2 * keys if self.attention_bias else 0
        attention += 2 * d if self.query_norms else 0
        return self.layers * (attention + 3 * h * self.intermediate + 2 * h) + h

    @property
    def embeddings(self) -> int:
        """The parameters of the embedding, and of the output matrix if it is another."""
        return self.vocabulary * self.hidden * (1 if self.tied else 2)

    @property
    def parameters(self) -> int:
        """All parameters."""
        vision = self.vision.tower + self.vision.projector if self.vision else 0
        return self.language + self.embeddings + vision

    def lora(self, rank: int) -> int:
        """The parameters of an adapter on all linear layers of the language model."""
        h, queries, keys = self.hidden, self.heads * self.head_dim, self.kv_heads * self.head_dim
        sides = 2 * (h + queries) + 2 * (h + keys) + 3 * (h + self.intermediate)
        return self.layers * rank * sides


@dataclass(frozen=True)
class Load:
    """What is trained, and on what.

    Attributes:
        tokens: of a batch on one GPU, pictures expanded.
        patches: of the pictures of a batch; about four for each of their tokens.
        lora_rank: None for full fine-tuning.
        freeze: ``vision``, ``projector``: what does not learn; with an adapter nothing of them
            does.
        new_tokens: whether, with an adapter, the embedding and the output matrix learn as a whole,
            because a token is new.
        gpus: how many share the work; ``sharded``: whether ZeRO-3 or FSDP divides the model.
        checkpointing: whether activations are computed again.
        half: False where everything is float32, as on a CPU.
    """

    tokens: int
    patches: int = 0
    lora_rank: int | None = None
    freeze: tuple[str, ...] = ("vision", "projector")
    new_tokens: bool = False
    gpus: int = 1
    sharded: bool = False
    checkpointing: bool = True
    half: bool = True


@dataclass(frozen=True)
class Memory:
    """Bytes on one GPU.

    Attributes:
        weights, gradients, optimizer, activations, logits: see the module.
        learning: how many parameters learn, on all GPUs together.
    """

    weights: int
    gradients: int
    optimizer: int
    activations: int
    logits: int
    learning: int

    @property
    def total(self) -> int:
        """The sum, with :data:`OVERHEAD`."""
        parts = (self.weights, self.gradients, self.optimizer, self.activations, self.logits)
        return sum(parts) + OVERHEAD


def estimate(shape: ModelShape, load: Load) -> Memory:
    """The memory of a run on one of its GPUs."""
    learning = _learning(shape, load)
    value = _HALF if load.half else _FULL
    shares = load.gpus if load.sharded else 1
    if load.lora_rank is None:
        weights = shape.parameters * value
        gradients = learning * value
        optimizer = learning * (_ADAM + (_FULL if load.half else 0))
    else:
        weights = shape.parameters * value + learning * _FULL
        gradients, optimizer = learning * _FULL, learning * _ADAM
    return Memory(
        weights=weights // shares,
        gradients=gradients // shares,
        optimizer=optimizer // shares,
        activations=_activations(shape, load, value),
        logits=load.tokens * shape.vocabulary * (_LOGITS if load.half else 2 * _FULL),
        learning=learning,
    )


def _learning(shape: ModelShape, load: Load) -> int:
    """How many parameters learn."""
    if load.lora_rank is not None:
        return shape.lora(load.lora_rank) + (shape.embeddings if load.new_tokens else 0)
    vision = shape.vision
    frozen = 0
    if vision is not None:
        frozen += vision.tower if "vision" in load.freeze else 0
        frozen += vision.projector if "projector" in load.freeze else 0
    return shape.parameters - frozen


def _activations(shape: ModelShape, load: Load, value: int) -> int:
    """Activations of the language model, and the inside of one layer of the vision tower."""
    h = shape.hidden
    attention = (2 * shape.heads + 2 * shape.kv_heads) * shape.head_dim
    inside = load.tokens * (4 * h + attention + 3 * shape.intermediate) * value
    inputs = load.tokens * h * value
    text = shape.layers * inputs + inside if load.checkpointing else shape.layers * inside
    vision = shape.vision
    if vision is None or not load.patches:
        return text
    mlp = (3 if vision.gated else 2) * vision.intermediate
    look = load.patches * (_VISION_INSIDE * vision.hidden + mlp) * value
    learns = load.lora_rank is None and "vision" not in load.freeze
    if learns and not load.checkpointing:
        look *= vision.layers
    elif learns:
        look += vision.layers * load.patches * vision.hidden * value
    return text + look


def shape_of(config: Mapping[str, Any]) -> ModelShape:
    """The shape of a model by what its ``config.json`` holds, whichever of the two layouts it has:
    newer files keep the language model's numbers in ``text_config``.

    Raises:
        ValueError: a number that is needed is not there.
    """
    text = {**config, **(config.get("text_config") or {})}
    kind = str(config.get("model_type", ""))
    try:
        hidden, heads = int(text["hidden_size"]), int(text["num_attention_heads"])
        return ModelShape(
            layers=int(text["num_hidden_layers"]),
            hidden=hidden,
            intermediate=int(text["intermediate_size"]),
            heads=heads,
            kv_heads=int(text.get("num_key_value_heads") or heads),
            head_dim=int(text.get("head_dim") or hidden // heads),
            vocabulary=int(text["vocab_size"]),
            # Whole models of transformers say it at the top; their text part has a default.
            tied=bool(config.get("tie_word_embeddings", text.get("tie_word_embeddings", False))),
            attention_bias=kind.startswith("qwen2") or bool(text.get("attention_bias")),
            query_norms=kind.startswith("qwen3"),
            vision=_vision(kind, config["vision_config"], hidden)
            if config.get("vision_config")
            else None,
        )
    except KeyError as error:
        raise ValueError(
            f"the model's configuration ({kind or 'no model_type'}) lacks {error.args[0]!r}, so its "
            "memory cannot be estimated; give a Qwen-VL model, or a language model of Llama's build"
        ) from error


def _vision(kind: str, vision: Mapping[str, Any], out: int) -> VisionShape:
    older = kind == "qwen2_vl"
    hidden = int(vision["embed_dim"] if older else vision["hidden_size"])
    deepstack = vision.get("deepstack_visual_indexes") or ()
    newer = kind.startswith("qwen3")
    return VisionShape(
        layers=int(vision["depth"]),
        hidden=hidden,
        intermediate=int(hidden * vision["mlp_ratio"] if older else vision["intermediate_size"]),
        gated=kind == "qwen2_5_vl",
        patch=int(vision.get("patch_size", 14)),
        temporal=int(vision.get("temporal_patch_size", 2)),
        merge=int(vision.get("spatial_merge_size", 2)),
        out=out,
        rms=kind == "qwen2_5_vl",
        mergers=len(deepstack) if newer else 0,
        positions=int(vision.get("num_position_embeddings", 0)) if newer else 0,
        patch_bias=newer,
    )
