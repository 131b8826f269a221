"""The memory that a printed run is expected to take, as a table."""

from __future__ import annotations

from dataclasses import replace

from agents.finetune.launchers.plan import LaunchPlan
from agents.finetune.memory import (
    GIB,
    MemoryEstimate,
    ModelDimensions,
    TuningSetup,
    estimate_memory,
)
from agents.finetune.models import load_facts, model_names
from agents.finetune.settings import FinetuneSettings, Lora
from er_gym.tables import Table

_PATCHES_A_TOKEN = 4
_TRAINED = 16
"""Bytes for each weight that learns: the weight, its gradient, and two moments in float32."""
PARTS = ("weights", "gradients", "optimizer", "activations", "logits", "overhead")


def expected(
    numbers: ModelDimensions,
    settings: FinetuneSettings,
    *,
    tokens: int,
    picture_tokens: int,
    gpus: int,
    new_tokens: bool = False,
) -> MemoryEstimate:
    """The memory on one GPU.

    Args:
        numbers: the model's.
        settings: the run's.
        tokens, picture_tokens: of a conversation; these programs compute logits for all of them.
        gpus: how many; with full fine-tuning ZeRO-3 spreads the model over them.
        new_tokens: whether, with LoRA, embedding and output matrix learn as a whole, because a
            token is new.
    """
    lora = settings.model.lora
    plan = TuningSetup(
        precision="float32" if settings.model.dtype == "float32" else "bfloat16",
        lora_rank=lora.rank if lora else None,
        freeze=settings.model.freeze,
        checkpointing=settings.training.checkpointing,
        batch=settings.training.batch,
        tokens=tokens,
        learnt=tokens,
        patches=picture_tokens * _PATCHES_A_TOKEN,
        gpus=1 if lora else gpus,
    )
    found = estimate_memory(numbers, plan)
    if lora is None or not new_tokens:
        return found
    more = numbers.embeddings
    return replace(
        found,
        weights=found.weights + 4 * more,
        gradients=found.gradients + 4 * more,
        optimizer=found.optimizer + 8 * more,
        overhead=found.overhead + _TRAINED * more // 10,
    )


def run_table(plan: LaunchPlan, *, whole_embeddings: bool) -> Table:
    """A table of this run: at its longest conversation, and at the most it may have."""
    facts, limit = plan.facts, plan.settings.data.max_length
    share = facts.picture_tokens / max(1, facts.tokens)
    rows = [
        (f"longest conversation here, about {facts.tokens:,} tokens", facts.tokens),
        (f"`data.max_length`, {limit:,} tokens", limit),
    ]
    lines = []
    for told, tokens in rows:
        found = expected(
            plan.model.facts.numbers,
            plan.settings,
            tokens=tokens,
            picture_tokens=round(tokens * share),
            gpus=plan.gpus,
            new_tokens=facts.feedback and whole_embeddings,
        )
        cells = (_gib(getattr(found, part)) for part in PARTS)
        lines.append((told, *cells, f"**{_gib(found.total)}**"))
    return Table("", ("GiB on each GPU", *PARTS, "sum"), tuple(lines), 1)


def models_table(plan: LaunchPlan) -> Table:
    """A table of all models that er-gym knows, full and LoRA, at this run's length."""
    facts, settings = plan.facts, plan.settings
    lora = settings.model.lora or Lora()
    counts = (1, 2, 4, 8)
    lines = []
    for name in model_names():
        numbers = load_facts(name).numbers
        cells = []
        for adapter, gpus in (*((None, n) for n in counts), (lora, 1)):
            model = settings.model.model_copy(update={"lora": adapter})
            found = expected(
                numbers,
                settings.model_copy(update={"model": model}),
                tokens=facts.tokens,
                picture_tokens=facts.picture_tokens,
                gpus=gpus,
            )
            cells.append(_gib(found.total))
        lines.append((name, *cells))
    full = (f"full, {n} GPU{'s' * (n > 1)}" for n in counts)
    return Table("", ("model", *full, "LoRA"), tuple(lines), 1)


def _gib(count: int) -> str:
    return f"{count / GIB:.1f}"
