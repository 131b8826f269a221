"""Fine-tunes a model on conversations, from its settings, or continues where it was.

Read it from top to bottom: :func:`train` is the whole run. The loop is that of transformers'
``Trainer``, which knows accelerate, DeepSpeed and FSDP. TRL's ``SFTTrainer`` builds on the same.
What it adds are labels and batches, which are our own here, for the flags of turns; and its loss,
which on a CPU (TRL 1.16) computes the scores of every token, learnt or not.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import transformers
from transformers.trainer_utils import set_seed

import er_gym
from agents.finetune import machine
from agents.finetune.batches import Collator, EncodedChats, EpochSampler
from agents.finetune.feedback import FEEDBACK, add_feedback, add_rows, needs_feedback
from agents.finetune.libraries import flush_denormals, quiet_libraries
from agents.finetune.loop import FinetuneTrainer, Progress, TrainingLog, is_sharded
from agents.finetune.memory import (
    MemoryEstimate,
    TuningSetup,
    bytes_text,
    dimensions_of,
    estimate_memory,
)
from agents.finetune.model_files import (
    History,
    ModelFiles,
    StageRecord,
    check_prompts,
    check_stage,
    open_model,
    settings_as_json,
)
from agents.finetune.network import (
    chosen_dtype,
    keep_learning_part_exact,
    load_network,
    with_learning_part,
)
from agents.finetune.optimizer import MuonAdamW
from agents.finetune.run_files import FINETUNING, FinetuneManifest, RunFiles
from agents.finetune.samples import Samples, open_samples
from agents.finetune.settings import FinetuneSettings
from agents.finetune.tokens import EncodedChat, Encoder, check_lengths
from agents.vlm.clients.checkpoint import error_summary
from agents.vlm.tuned_model import recorded_pictures
from er_gym.activity import begin

_MOST_READERS = 8
_CPU_LENGTHS = 32  # lengths of batches are multiples


@dataclass(frozen=True)
class Result:
    """A finished run.

    Attributes:
        path: the run directory.
        conversations, left_out: how many were trained on, and how many have no turn with loss.
        updates: how many there were in all.
        first_loss, loss: the first and the last that were logged.
        new: whether anything was left to do.
    """

    path: Path
    conversations: int
    left_out: int
    updates: int
    first_loss: float
    loss: float
    new: bool


def train(
    settings: FinetuneSettings,
    model: Path,
    data: Sequence[Path],
    out: Path,
    *,
    ignore_memory: bool = False,
    report: Callable[[Progress], None] = lambda progress: None,
    say: Callable[[str], None] | None = None,
) -> Result:
    """Fine-tune a model, or continue the same run.

    Args:
        settings: of the run.
        model: a model directory, or a finished run.
        data: what is learnt from, one after the other
            (:func:`agents.finetune.samples.open_samples`).
        out: the run directory.
        ignore_memory: train although it will probably not fit into the memory.
        report: is told each time that something is logged.
        say: is told in a sentence what goes on; both in the first process of several.

    Raises:
        ValueError: settings, model and data do not go together, or there is not enough memory.
        FolderConflict: the directory holds another run.
        Locked: another process trains in the directory.
        KeyboardInterrupt: Ctrl-C; what was learnt since the last checkpoint is lost.
    """
    # -- files alone: what is wrong with them is said before anything is written or loaded --
    begin(f"reading the model {model}")
    files = open_model(model)
    check_stage(files, settings.after)
    begin("reading the conversations")
    samples = open_samples(data, settings.data)
    check_prompts(files, samples.prompts)
    manifest = FinetuneManifest(
        settings=settings_as_json(settings),
        model=str(files.path),
        model_digest=files.digest,
        data=[str(path.resolve()) for path in data],
        data_digest=samples.digest,
        history=files.history,
        er_gym=er_gym.__version__,
    )
    run = RunFiles(out)
    first = machine.is_first()
    if say is None or not first:
        say = _to_nobody
    with ExitStack() as stack:
        if first:
            stack.enter_context(FINETUNING.locked(out, manifest))
        else:
            FINETUNING.check(out, manifest)
        stack.enter_context(quiet_libraries())
        if run.finished:
            return _result(run, samples, new=False)
        return _train(settings, files, samples, run, manifest, first, ignore_memory, report, say)


def _train(
    settings: FinetuneSettings,
    files: ModelFiles,
    samples: Samples,
    run: RunFiles,
    manifest: FinetuneManifest,
    first: bool,
    ignore_memory: bool,
    report: Callable[[Progress], None],
    say: Callable[[str], None],
) -> Result:
    # -- tokens: all conversations, whole --
    begin(f"turning {len(samples.chats):,} conversations into tokens")
    tokenizer = files.tokenizer
    feedback = needs_feedback(samples.chats)
    is_new = feedback and FEEDBACK not in tokenizer.get_vocab()
    if is_new:
        add_feedback(tokenizer)
    image_token = files.config.image_token_id if files.has_vision else None
    encoder = Encoder(tokenizer, files.template, files.image_processor, image_token, settings.data)
    chats = [encoder.encode(chat) for chat in samples.chats]
    learnt = [chat for chat in chats if chat.learnt_tokens]
    if not learnt:  # with the mask `released`, the last reply may come before the feedback
        raise ValueError(
            f"{', '.join(manifest.data)}: with data.mask={settings.data.mask} no token of its "
            f"{len(chats):,} conversations is learnt; give other data or set data.mask"
        )
    samples = replace(samples, left_out=samples.left_out + len(chats) - len(learnt))
    chats = learnt
    check_lengths(chats, settings.data.max_length, ", ".join(manifest.data))
    say(_about(chats, samples))

    # -- devices: as the launcher, DeepSpeed or FSDP wants them; in bfloat16 where that is fast --
    dtype = chosen_dtype(settings.model)
    arguments = _arguments(settings, run, dtype)
    if settings.training.optimizer == "muon" and is_sharded(arguments):
        raise ValueError(
            "training.optimizer=muon needs whole matrices, which DeepSpeed and FSDP divide; set "
            "training.optimizer=adamw"
        )
    needed = _memory(settings, files, chats, dtype, arguments.world_size)
    free = machine.free_memory()
    if needed.total > free and not ignore_memory:
        raise ValueError(
            f"this would take about {needed}, and {bytes_text(free)} of "
            f"{'GPU memory' if machine.on_gpu() else 'memory'} are free; set a lower "
            "training.batch, training.checkpointing=true, model.lora.rank=8 or a lower "
            "data.max_pixels, take a smaller model, or give --ignore-memory"
        )
    say(f"memory, estimated: {needed}")

    begin("loading the weights")
    # -- the model: its weights, the token <|feedback|>, and what learns --
    set_seed(settings.training.seed)
    # FSDP keeps weights as they are loaded; DeepSpeed keeps a copy in float32 itself. Without an
    # adapter, weights that stay as they are are written again, so they are not rounded.
    as_they_are = settings.model.lora is None and dtype == "bfloat16" and not is_sharded(arguments)
    loaded = "float32" if arguments.fsdp else "auto" if as_they_are else dtype
    network = load_network(files, settings.model, loaded)
    if is_new:
        add_rows(network, tokenizer)
    network = with_learning_part(network, settings.model, files, tokenizer, feedback)
    if dtype == "bfloat16" and not is_sharded(arguments):
        keep_learning_part_exact(network)

    # -- the loop --
    if first:
        run.clear()
    padding = tokenizer.pad_token_id
    padding = padding if padding is not None else (tokenizer.eos_token_id or 0)
    trainer = FinetuneTrainer(
        network,
        arguments,
        EpochSampler(
            [chat.length for chat in chats],
            settings.training.batch,
            settings.training.seed,
            settings.training.buckets,
        ),
        run,
        settings.training.keep,
        data_collator=Collator(
            files.image_processor,
            image_token,
            settings.data.bounds,
            padding,
            multiple=1 if machine.on_gpu() else _CPU_LENGTHS,
        ),
        train_dataset=EncodedChats(chats),
        optimizers=(_optimizer(network, settings), None),
    )
    trainer.accelerator.wait_for_everyone()
    last = run.last_checkpoint()
    done = int(last.name.rpartition("-")[2]) if last else 0
    if first:
        run.rewind_metrics(done)
        trainer.add_callback(TrainingLog(run, trainer, done, report))
    if last is not None:
        say(f"continues after update {done:,}")
    begin("training")
    with flush_denormals():
        trainer.train(resume_from_checkpoint=str(last) if last else None)

    # -- the result --
    begin("writing the model")
    loss = run.metrics()[-1]["loss"] if first else 0.0
    record = StageRecord(
        stage=settings.stage,
        run=str(run.path.resolve()),
        data=manifest.data,
        data_digest=manifest.data_digest,
        settings=manifest.settings,
        conversations=len(chats),
        updates=trainer.state.global_step,
        loss=loss,
    )
    history = History(runs=(*files.history.runs, record))
    trainer.write_result(files, history, _agent(settings, samples), tokenizer)
    return _result(run, samples, new=True)


# -- settings as transformers has them -------------------------------------------------------------


def _arguments(
    settings: FinetuneSettings, run: RunFiles, dtype: str
) -> transformers.TrainingArguments:
    training, lora = settings.training, settings.model.lora is not None
    gpu = machine.on_gpu()
    vision_learns = "vision" not in settings.model.freeze and not lora
    try:
        return transformers.TrainingArguments(
            output_dir=str(run.checkpoints),
            learning_rate=training.learning_rate,
            num_train_epochs=training.epochs,
            weight_decay=training.weight_decay,
            max_grad_norm=training.max_grad_norm,
            per_device_train_batch_size=training.batch,
            gradient_accumulation_steps=training.accumulation,
            lr_scheduler_type="cosine",
            warmup_steps=min(training.warmup, 0.999),  # below 1 it is a share of the updates
            activation_checkpointing=training.checkpointing,
            activation_checkpointing_kwargs={"use_reentrant": False},
            optim="adamw_torch_fused",
            bf16=dtype == "bfloat16",
            use_cpu=not gpu,
            save_strategy="steps",
            save_steps=training.save_every,
            logging_steps=training.log_every,
            logging_nan_inf_filter=False,  # TrainingLog says so
            seed=training.seed,
            deepspeed=training.deepspeed or None,
            fsdp=training.fsdp or None,
            # A conversation without pictures leaves a vision tower that learns without gradients.
            ddp_find_unused_parameters=vision_learns,
            dataloader_num_workers=min(_MOST_READERS, (os.cpu_count() or 1) - 1) if gpu else 0,
            dataloader_pin_memory=gpu,
            remove_unused_columns=False,
            label_names=["labels"],
            report_to="none",
            disable_tqdm=True,
            log_level="error",
        )
    except (OSError, ImportError, json.JSONDecodeError) as error:
        raise ValueError(f"training.deepspeed or training.fsdp: {error_summary(error)}") from None


def _optimizer(network: Any, settings: FinetuneSettings) -> MuonAdamW | None:
    """The optimizer, None for the trainer's own, AdamW."""
    training = settings.training
    if training.optimizer == "adamw":
        return None
    return MuonAdamW(network, training.learning_rate, training.weight_decay)


def _memory(
    settings: FinetuneSettings, files: ModelFiles, chats: list[EncodedChat], dtype: str, gpus: int
) -> MemoryEstimate:
    merge = files.image_processor.merge_size**2 if files.has_vision else 1
    plan = TuningSetup(
        precision="bfloat16" if dtype == "bfloat16" else "float32",
        lora_rank=settings.model.lora.rank if settings.model.lora else None,
        freeze=settings.model.freeze,
        checkpointing=settings.training.checkpointing,
        batch=min(settings.training.batch, len(chats)),
        tokens=max(chat.length for chat in chats),
        learnt=max(chat.learnt_tokens for chat in chats),
        patches=max(sum(chat.picture_tokens) for chat in chats) * merge,
        gpus=gpus if settings.training.deepspeed or settings.training.fsdp else 1,
        on_gpu=machine.on_gpu(),
    )
    return estimate_memory(dimensions_of(files.config.to_dict()), plan)


def _about(chats: list[EncodedChat], samples: Samples) -> str:
    tokens, learnt = (
        sum(getattr(each, name) for each in chats) for name in ("length", "learnt_tokens")
    )
    pictures = sum(len(each.pictures) for each in chats)
    left = f"; {samples.left_out:,} without a turn to learn left out" if samples.left_out else ""
    return (
        f"{len(chats):,} conversations, {pictures:,} pictures, {tokens:,} tokens, of which "
        f"{learnt:,} are learnt; the longest has {max(each.length for each in chats):,}{left}"
    )


def _to_nobody(text: str) -> None:
    """Say nothing."""


# -- the result ------------------------------------------------------------------------------------


def _agent(settings: FinetuneSettings, samples: Samples) -> dict[str, Any]:
    """How the model was taught to converse, as settings of a model agent."""
    found: dict[str, Any] = {"prompts": dict(samples.prompts), "sees": samples.sees}
    if samples.sees == "pictures":
        found["pictures"] = recorded_pictures(
            samples.recorded, settings.data.min_pixels, settings.data.max_pixels
        )
    return found


def _result(run: RunFiles, samples: Samples, *, new: bool) -> Result:
    lines = run.metrics()
    return Result(
        path=run.path,
        conversations=len(samples.chats),
        left_out=samples.left_out,
        updates=lines[-1]["update"],
        first_loss=lines[0]["loss"],
        loss=lines[-1]["loss"],
        new=new,
    )
