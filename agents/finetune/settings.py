"""The settings of a fine-tuning run: one validated YAML file. Imports no model library.

er-gym's own files are ``configs/finetune/NAME.yaml``. Every field has a default. ``er-gym finetune
--config stage1 --set training.epochs=2`` overrides a field.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import Field, model_validator

from agents.configs import ConfigKind, StrictSettings
from er_gym.data.trajectory import Language, Trajectory

Stage: TypeAlias = Literal["imitation", "exploration", "reflection"]
"""The paper's three stages, in order; they make the Interactor, the Explorer and the Reasoner."""
STAGES: tuple[Stage, ...] = ("imitation", "exploration", "reflection")
Mask: TypeAlias = Literal["turns", "released", "all"]
"""Which tokens get loss, see :class:`DataSettings`."""

Fraction = Annotated[float, Field(ge=0, le=1)]
Positive = Annotated[int, Field(gt=0, le=2**31)]
Rate = Annotated[float, Field(gt=0, le=10)]


class Lora(StrictSettings):
    """A low-rank adapter (PEFT's names).

    Attributes:
        rank, alpha, dropout: of the adapter. The paper's code has rank 8; LLaMA-Factory, which it
            uses, takes twice the rank for alpha.
        targets: ``all-linear`` for all linear layers of the language model, or the names of layers.
    """

    rank: Positive = 8
    alpha: Positive = 16
    dropout: Fraction = 0.0
    targets: Literal["all-linear"] | tuple[str, ...] = "all-linear"


class ModelSettings(StrictSettings):
    """The model that is tuned.

    Attributes:
        lora: the adapter; None for full fine-tuning.
        freeze: parts of a vision-language model that do not learn: ``vision`` is the vision tower,
            ``projector`` what turns its features into the language model's.
        dtype: of multiplications; ``auto`` is bfloat16 on a GPU or a CPU with instructions for
            it (AVX512-BF16, AMX), else float32. Weights that learn are kept in float32.
        attention: of ``from_pretrained``; "" for the library's choice.
    """

    lora: Lora | None = None
    freeze: tuple[Literal["vision", "projector"], ...] = ("vision", "projector")
    dtype: Literal["auto", "bfloat16", "float32"] = "auto"
    attention: str = ""


class DataSettings(StrictSettings):
    """The training data.

    Attributes:
        parts: of a collection; all if empty.
        kinds: of its trajectories, such as ``a`` (:mod:`er_gym.data.trajectory`); all if empty.
        dialect: how trajectories are put into words (:mod:`er_gym.data.dialects`); its words are
            also the prompts with which the tuned model plays.
        language: of the dialect's texts; None for that of the thoughts.
        mask: ``turns``: the turns that the trajectories mark ``train`` get loss, so that in the
            third stage the faulty step and all before it get none, as the paper describes.
            ``released``: all turns after the first ``<|feedback|>`` get loss, and if there is none,
            all; so does the paper's released code. ``all``: as ``turns``, and the text of the
            system's and user's messages, without pictures; a model from random weights learns
            faster so.
        word_noise: with this probability, each word of an English instruction that is in no name of
            an object type is replaced by random syllables. A model from random weights learns so to
            read instructions with words that are new to it. Only for collections; frames beside
            them stay as they are.
        other_wordings: with this probability, an English instruction is first told in a wording
            of :mod:`er_gym.tasks.wordings.english_further`, none of which is kept for evaluation.
            Only for collections, too, and for tasks that er-gym generated.
        max_length: the most tokens of a conversation. A longer one is an error: to cut it would cut
            pictures.
        min_pixels, max_pixels: a picture with fewer or more is scaled.
        limit: the most conversations, drawn at random, always the same; None for all.
    """

    parts: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    dialect: str = "paper"
    language: Language | None = None
    mask: Mask = "turns"
    word_noise: Fraction = 0.0
    other_wordings: Fraction = 0.0
    max_length: Positive = 32_768
    min_pixels: Positive = 3_136
    max_pixels: Positive = 180_000
    limit: Positive | None = None

    @model_validator(mode="after")
    def _bounds_in_order(self) -> DataSettings:
        if self.min_pixels > self.max_pixels:
            raise ValueError(
                f"min_pixels {self.min_pixels} is more than max_pixels {self.max_pixels}"
            )
        return self

    @property
    def bounds(self) -> tuple[int, int]:
        """The least and the most pixels of a picture."""
        return self.min_pixels, self.max_pixels

    def takes(self, part: str, kind: str) -> bool:
        """Whether a trajectory of this part and kind is used."""
        return (not self.parts or part in self.parts) and (not self.kinds or kind in self.kinds)

    def refuse_other_words(self, path: Path) -> None:
        """Refuse to change instructions where they cannot be told from other words.

        Raises:
            ValueError: it is asked for, and the path is no collection.
        """
        for name in ("word_noise", "other_wordings"):
            if share := getattr(self, name):
                raise ValueError(
                    f"{path} is no collection of er-gym collect, and data.{name}={share} is for "
                    f"those; set data.{name}=0"
                )

    def check_choice(self, where: str, trajectories: Iterable[Trajectory]) -> None:
        """Refuse a part or a kind that no trajectory has.

        Args:
            where: the name of what holds the trajectories.
            trajectories: read only if something is chosen.

        Raises:
            ValueError: see above.
        """
        if not (self.parts or self.kinds):
            return
        there = {(each.part, each.kind) for each in trajectories}
        for name, wanted, place in (("part", self.parts, 0), ("kind", self.kinds, 1)):
            found = sorted({each[place] for each in there})
            missing = sorted(set(wanted) - set(found))
            if missing:
                raise ValueError(
                    f"{where} has no trajectories of the {name} {', '.join(missing)}; it has: "
                    f"{', '.join(found) or 'none'}; set data.{name}s, such as "
                    f"--set 'data.{name}s=[{', '.join(found)}]'"
                )


class TrainingSettings(StrictSettings):
    """How the model is trained: parameters of transformers' ``TrainingArguments``.

    Attributes:
        learning_rate, epochs, weight_decay, max_grad_norm: as there.
        optimizer: ``adamw``; or ``muon`` for the matrices of the layers, with AdamW for all other
            weights: a model from random weights learns faster so.
        batch, accumulation: conversations a device and step, and steps an update.
        warmup: the share of the updates in which the learning rate rises; then it follows a cosine.
        checkpointing: whether activations are computed again instead of stored.
        buckets: whether the conversations of a batch are of similar length.
        save_every, log_every: in updates. A checkpoint is also written at the end.
        keep: how many checkpoints stay.
        seed: of the order and of all new weights.
        deepspeed, fsdp: a DeepSpeed configuration file, and FSDP options, for several GPUs; "" for
            none.
    """

    learning_rate: Rate = 1e-5
    epochs: float = Field(1.0, gt=0, le=10_000)
    weight_decay: Fraction = 0.0
    max_grad_norm: float = Field(1.0, gt=0)
    optimizer: Literal["adamw", "muon"] = "adamw"
    batch: Positive = 1
    accumulation: Positive = 1
    warmup: Fraction = 0.1
    checkpointing: bool = True
    buckets: bool = True
    save_every: Positive = 500
    log_every: Positive = 2
    keep: Positive = 2
    seed: int = Field(0, ge=0, lt=2**32)
    deepspeed: str = ""
    fsdp: str = ""


class FinetuneSettings(StrictSettings):
    """A fine-tuning run.

    Attributes:
        stage: which of the paper's stages it is; None for a run outside them.
        after: the stage that the model must have gone through; None for any model.
        model, data, training: see their classes.
    """

    stage: Stage | None = None
    after: Stage | None = None
    model: ModelSettings = ModelSettings()
    data: DataSettings = DataSettings()
    training: TrainingSettings = TrainingSettings()


load_settings = ConfigKind(FinetuneSettings, "finetune", "fine-tuning run").load
