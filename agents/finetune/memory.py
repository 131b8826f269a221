"""How much memory fine-tuning takes: bytes from a model's configuration and the plan, no weights.

The formula counts what transformers, PEFT and PyTorch keep, for decoder models with gated MLPs,
such as Llama and Qwen, and for the vision towers of Qwen2-VL, Qwen2.5-VL and Qwen3-VL.

==============  ==================================================================================
weights         2 bytes a parameter that stays as it is, in bfloat16; 4 in float32, and for one
                that learns, which bfloat16 arithmetic also keeps a copy of, 2 bytes more
gradients       4 bytes a parameter that learns
optimizer       8 bytes a parameter that learns: AdamW's two moments
activations     what the backward pass needs of each layer for each token; with checkpointing only
                each layer's input, and all of one layer at a time
logits          of the tokens that get loss: the scores, their logarithms and the gradients
overhead        libraries and fragments: 1 GiB and a tenth on a GPU, half a GiB on a CPU
==============  ==================================================================================

With ZeRO-3 over n GPUs weights, gradients and optimizer are 16 bytes a parameter that learns and 2
of another, spread over the GPUs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Literal

GIB = 1 << 30


@dataclass(frozen=True)
class VisionDimensions:
    """A vision tower: layers, sizes, and the projectors that turn its features into tokens.

    Attributes:
        layers, hidden, intermediate: of the tower.
        gated: whether its MLPs have three matrices, not two.
        patch_values: numbers in a patch.
        positions: learnt embeddings of places.
        merge: patches a side that become one token.
        out: the language model's size.
        projectors: how many.
        projector_hidden: the size between a projector's two layers.
    """

    layers: int
    hidden: int
    intermediate: int
    gated: bool
    patch_values: int
    positions: int
    merge: int
    out: int
    projectors: int = 1

    @property
    def tower(self) -> int:
        """Parameters, without projectors."""
        mlp = (3 if self.gated else 2) * self.hidden * self.intermediate
        layer = 4 * self.hidden**2 + mlp
        return self.layers * layer + (self.patch_values + self.positions) * self.hidden

    @property
    def projector(self) -> int:
        """Parameters of the projectors."""
        merged = self.hidden * self.merge**2
        return self.projectors * (merged**2 + merged * self.out)


@dataclass(frozen=True)
class ModelDimensions:
    """What the memory depends on in a model's configuration.

    Attributes:
        layers, hidden, intermediate, vocabulary: of the language model.
        heads, kv_heads, head_size: of its attention.
        tied: whether input and output embeddings are the same.
        vision: None for a text-only model.
    """

    layers: int
    hidden: int
    intermediate: int
    vocabulary: int
    heads: int
    kv_heads: int
    head_size: int
    tied: bool
    vision: VisionDimensions | None = None

    @property
    def attended(self) -> int:
        """The size of all queries of a token; ``keys`` of all keys."""
        return self.heads * self.head_size

    @property
    def keys(self) -> int:
        """The size of all keys of a token."""
        return self.kv_heads * self.head_size

    @property
    def linear(self) -> int:
        """Parameters of the language model's layers."""
        attention = self.hidden * (2 * self.attended + 2 * self.keys)
        return self.layers * (attention + 3 * self.hidden * self.intermediate)

    @property
    def embeddings(self) -> int:
        """Parameters of the embeddings, input and output."""
        return (1 if self.tied else 2) * self.vocabulary * self.hidden

    @property
    def parameters(self) -> int:
        """All; without biases and norms, which are less than a thousandth."""
        vision = self.vision.tower + self.vision.projector if self.vision else 0
        return self.linear + self.embeddings + vision

    def lora(self, rank: int) -> int:
        """Parameters of an adapter on all linear layers of the language model."""
        pairs = (
            2 * (self.hidden + self.attended)  # q, o
            + 2 * (self.hidden + self.keys)  # k, v
            + 3 * (self.hidden + self.intermediate)
        )
        return self.layers * rank * pairs


@dataclass(frozen=True)
class TuningSetup:
    """How a model is tuned, as far as memory depends on it.

    Attributes:
        precision: of the arithmetic.
        lora_rank: None for full fine-tuning.
        freeze: parts that are not trained, as in the settings.
        checkpointing: whether activations are computed again.
        batch: conversations at a time.
        tokens, learnt, patches: the most of a conversation: its tokens, those that get loss, and
            the patches of its pictures.
        gpus: over how many ZeRO-3 spreads what it can; 1 for none.
        on_gpu: whether it is trained on a GPU.
    """

    precision: Literal["bfloat16", "float32"]
    lora_rank: int | None
    freeze: tuple[str, ...]
    checkpointing: bool
    batch: int
    tokens: int
    learnt: int
    patches: int
    gpus: int = 1
    on_gpu: bool = True


@dataclass(frozen=True)
class MemoryEstimate:
    """Bytes, by what they are for; on one GPU, or of the process. See the module."""

    weights: int
    gradients: int
    optimizer: int
    activations: int
    logits: int
    overhead: int

    @property
    def total(self) -> int:
        """The sum."""
        return sum(getattr(self, each.name) for each in fields(self))

    def __str__(self) -> str:
        parts = ", ".join(
            f"{each.name} {bytes_text(getattr(self, each.name))}" for each in fields(self)
        )
        return f"{bytes_text(self.total)} ({parts})"


def estimate_memory(model: ModelDimensions, plan: TuningSetup) -> MemoryEstimate:
    """An estimate of the most memory that training takes."""
    small = 2 if plan.precision == "bfloat16" else 4
    trained = trained_parameters(model, plan)
    frozen = model.parameters - trained + (model.lora(plan.lora_rank) if plan.lora_rank else 0)
    copy = small if plan.precision == "bfloat16" else 0
    if plan.gpus > 1:
        weights = (2 + 4) * trained + 2 * frozen
        weights, gradients, optimizer = (
            each // plan.gpus for each in (weights, 2 * trained, 8 * trained)
        )
    else:
        weights = (4 + copy) * trained + small * frozen
        gradients, optimizer = 4 * trained, 8 * trained
    rows = plan.batch * plan.tokens
    activations = _activations(model, plan, rows, small)
    logits = plan.batch * plan.learnt * model.vocabulary * (small + 8)
    overhead = GIB // 2
    if plan.on_gpu:
        overhead = GIB + (weights + gradients + optimizer + activations + logits) // 10
    return MemoryEstimate(weights, gradients, optimizer, activations, logits, overhead)


def trained_parameters(model: ModelDimensions, plan: TuningSetup) -> int:
    """How many parameters are trained."""
    if plan.lora_rank is not None:
        return model.lora(plan.lora_rank)
    learnt = model.linear + model.embeddings
    if model.vision is not None:
        learnt += 0 if "vision" in plan.freeze else model.vision.tower
        learnt += 0 if "projector" in plan.freeze else model.vision.projector
    return learnt


def _activations(model: ModelDimensions, plan: TuningSetup, rows: int, small: int) -> int:
    """Bytes that wait for the backward pass, and those of the vision tower, which may not."""
    full = plan.lora_rank is None
    # Full fine-tuning has embeddings in float32, and so what runs from layer to layer.
    stream = 4 if full else small
    # A norm keeps its input in float32; its result, as what comes next reads it; and, if it learns
    # itself, what its weights are multiplied with.
    norms = 2 * model.hidden * ((8 if full else 4) + small)
    attention = small * 2 * (model.attended + model.keys)  # queries and result, keys and values
    mlp = small * 4 * model.intermediate  # gate, its activation, the other half, the product
    layer = norms + attention + mlp
    if plan.checkpointing:
        found = rows * ((model.layers + 2) * stream * model.hidden + 2 * layer)
    else:
        found = rows * (model.layers * layer + 2 * stream * model.hidden)
    if model.vision is not None:
        patches = plan.batch * plan.patches
        wide = small * (8 * model.vision.hidden + 3 * model.vision.intermediate)
        frozen = "vision" in plan.freeze or plan.lora_rank is not None
        once = frozen or plan.checkpointing
        found += patches * wide * (2 if once else model.vision.layers)
        found += patches * 4 * model.vision.patch_values
    return found


def dimensions_of(config: Mapping[str, Any]) -> ModelDimensions:
    """The numbers of a model by its ``config.json``, of today's transformers or an older one.

    Raises:
        ValueError: an entry is missing; the message names it.
    """
    text = {**config, **config.get("text_config", {})}
    try:
        heads = text["num_attention_heads"]
        return ModelDimensions(
            layers=text["num_hidden_layers"],
            hidden=text["hidden_size"],
            intermediate=text["intermediate_size"],
            vocabulary=text["vocab_size"],
            heads=heads,
            kv_heads=text.get("num_key_value_heads") or heads,
            head_size=text.get("head_dim") or text["hidden_size"] // heads,
            tied=bool(config.get("tie_word_embeddings", text.get("tie_word_embeddings", False))),
            vision=_vision(config["vision_config"], text["hidden_size"])
            if config.get("vision_config")
            else None,
        )
    except KeyError as error:
        raise ValueError(
            f"the model's configuration has no {error.args[0]}, so its memory cannot be foreseen; "
            "skip the check of memory"
        ) from None


def _vision(config: Mapping[str, Any], out: int) -> VisionDimensions:
    # Qwen2-VL calls the tower's size embed_dim, and the language model's hidden_size.
    first = "embed_dim" in config
    hidden = config["embed_dim"] if first else config["hidden_size"]
    wide = int(hidden * config.get("mlp_ratio", 4)) if first else config["intermediate_size"]
    side = config.get("patch_size", 14)
    channels = config.get("in_channels", config.get("in_chans", 3))
    return VisionDimensions(
        layers=config["depth"],
        hidden=hidden,
        intermediate=wide,
        gated=not first and "fullatt_block_indexes" in config,
        patch_values=channels * config.get("temporal_patch_size", 2) * side**2,
        positions=config.get("num_position_embeddings", 0),
        merge=config.get("spatial_merge_size", 2),
        out=config.get("out_hidden_size", out) if not first else out,
        projectors=1 + len(config.get("deepstack_visual_indexes", ())),
    )


def bytes_text(count: int) -> str:
    """A number of bytes in words."""
    return f"{count / GIB:.1f} GiB" if count >= GIB / 10 else f"{count / (1 << 20):.0f} MiB"
