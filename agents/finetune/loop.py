"""The loop of a fine-tuning run: transformers' ``Trainer`` with our loss, order and checkpoints."""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import safetensors.torch
import torch
import transformers
from torch.nn import functional
from torch.utils.tensorboard import SummaryWriter

from agents.finetune import machine
from agents.finetune.batches import EpochSampler
from agents.finetune.model_files import History, ModelFiles, write_agent_files
from agents.finetune.network import learning_part, put_back, save_network
from agents.finetune.run_files import (
    LOGS,
    METRICS,
    RunFiles,
    draft_of,
    move_into_place,
    replaced_folder,
)
from er_gym.activity import begin

TRAINED = "trained.safetensors"
"""The weights that learn, in a checkpoint."""


@dataclass(frozen=True)
class Progress:
    """How far a run is.

    Attributes:
        update, updates: how many are done, and of how many.
        loss: the mean over the learnt tokens since the last report.
        tokens_per_second: of all devices, since the last report.
        seconds_left: estimated from the time per update since the last report.
        memory: bytes in use (:func:`agents.finetune.machine.used_memory`).
    """

    update: int
    updates: int
    loss: float
    tokens_per_second: float
    seconds_left: float
    memory: int


def is_sharded(arguments: transformers.TrainingArguments) -> bool:
    """Whether DeepSpeed or FSDP holds the weights; then they write and read checkpoints."""
    return bool(arguments.deepspeed or arguments.fsdp) or "ACCELERATE_USE_FSDP" in os.environ


class LearntOnly:
    """Lets the output embedding compute scores only for the places that get loss.

    Those are often a tenth of the tokens, and a vocabulary is large. As a hook on the output
    embedding it works inside of whatever wraps the model.
    """

    def __init__(self, network: Any) -> None:
        self._places: torch.Tensor | None = None
        network.get_output_embeddings().register_forward_pre_hook(self._choose)

    @contextmanager
    def at(self, labels: torch.Tensor) -> Iterator[None]:
        """Within the context, scores are (1, learnt tokens, vocabulary).

        Args:
            labels: (conversations, longest), -100 where there is no loss.
        """
        after = torch.cat([labels[:, 1:], torch.full_like(labels[:, :1], -100)], dim=1)
        self._places = after.ne(-100)
        try:
            yield
        finally:
            self._places = None

    def _choose(self, layer: Any, inputs: tuple[torch.Tensor, ...]) -> tuple[torch.Tensor] | None:
        hidden = inputs[0]  # (conversations, longest, size)
        return None if self._places is None else (hidden[self._places][None],)


def mean_loss(outputs: Any, labels: torch.Tensor, num_items_in_batch: Any = None) -> torch.Tensor:
    """Cross entropy: the sum over the learnt tokens by the number of those in the whole update.

    Args:
        outputs: of the model, within :meth:`LearntOnly.at`.
        labels: (conversations, longest), -100 where there is no loss.
        num_items_in_batch: the learnt tokens of all batches of the update; those of this if None.
    """
    wanted = labels[:, 1:]
    wanted = wanted[wanted.ne(-100)]
    scores = outputs.logits[0].float()  # (learnt tokens, vocabulary)
    total = functional.cross_entropy(scores, wanted, reduction="sum")
    return total / (len(wanted) if num_items_in_batch is None else num_items_in_batch)


# -- the loop --------------------------------------------------------------------------------------


class FinetuneTrainer(transformers.Trainer):
    """Transformers' trainer, with our order and loss, and checkpoints that are whole or not there.

    A checkpoint holds the trained weights, by their names in the model. Transformers' own would
    hold them by the names of older versions, and those of Qwen2-VL and Qwen2.5-VL it does not read
    again: it would continue with the weights of the beginning, and say nothing (5.23).
    """

    def __init__(
        self,
        network: Any,
        arguments: transformers.TrainingArguments,
        order: EpochSampler,
        run: RunFiles,
        keep: int,
        **more: Any,
    ) -> None:
        super().__init__(network, arguments, compute_loss_func=mean_loss, **more)
        self.remove_callback(transformers.PrinterCallback)
        self.model_accepts_loss_kwargs = False
        self._order, self._run, self._keep = order, run, keep
        self._learnt_only = LearntOnly(network)
        self.tokens = 0

    def _get_train_sampler(self, train_dataset: Any = None) -> EpochSampler:
        return self._order

    def compute_loss(self, model: Any, inputs: dict[str, Any], *args: Any, **kwargs: Any) -> Any:
        self.tokens += inputs.pop("tokens")
        with self._learnt_only.at(inputs["labels"]):
            return super().compute_loss(model, {**inputs, "use_cache": False}, *args, **kwargs)

    def _save_checkpoint(self, model: Any, trial: Any) -> None:
        super()._save_checkpoint(model, trial)  # into _get_output_dir
        self.accelerator.wait_for_everyone()
        if self.args.should_save:
            name = f"checkpoint-{self.state.global_step}"
            draft = Path(self._get_output_dir(trial))
            move_into_place(draft / name, self._run.checkpoints / name)
            draft.rmdir()
            self._run.prune(self._keep)
        self.accelerator.wait_for_everyone()

    def _get_output_dir(self, trial: Any) -> str:
        return str(draft_of(self._run.checkpoints / "new"))

    def save_model(self, output_dir: str | None = None, _internal_call: bool = False) -> None:
        if is_sharded(self.args):
            super().save_model(output_dir, _internal_call=True)
        elif self.args.should_save:
            assert output_dir is not None
            os.makedirs(output_dir, exist_ok=True)
            weights = learning_part(self.accelerator.unwrap_model(self.model))
            safetensors.torch.save_file(weights, Path(output_dir) / TRAINED)

    def _load_from_checkpoint(self, resume_from_checkpoint: str, model: Any = None) -> None:
        if is_sharded(self.args):
            super()._load_from_checkpoint(resume_from_checkpoint, model)
            return
        there = safetensors.torch.load_file(Path(resume_from_checkpoint) / TRAINED)
        put_back(self.accelerator.unwrap_model(self.model), there, resume_from_checkpoint)

    def write_result(
        self, files: ModelFiles, history: History, agent: dict[str, Any], tokenizer: Any
    ) -> None:
        """Write the run's ``model/``."""
        with ExitStack() as stack:
            folder = draft_of(self._run.model)
            if self.args.should_save:
                stack.enter_context(replaced_folder(self._run.model))
            if is_sharded(self.args):
                super().save_model(str(folder), _internal_call=True)
            elif self.args.should_save:
                save_network(self.accelerator.unwrap_model(self.model), files, folder)
            if self.args.should_save:
                for unneeded in ("training_args.bin", "README.md"):
                    (folder / unneeded).unlink(missing_ok=True)
                tokenizer.save_pretrained(folder)
                write_agent_files(folder, history, agent, files)


class TrainingLog(transformers.TrainerCallback):
    """Writes ``metrics.jsonl`` and TensorBoard's logs, and reports progress."""

    def __init__(
        self, run: RunFiles, trainer: FinetuneTrainer, done: int, report: Callable[[Progress], None]
    ) -> None:
        self._run, self._trainer, self._report = run, trainer, report
        self._board = SummaryWriter(str(run.path / LOGS), purge_step=done + 1)
        self._update, self._since, self._tokens = done, time.monotonic(), 0

    def on_train_begin(self, args: Any, state: Any, control: Any, **more: Any) -> None:
        self._since = time.monotonic()

    def on_step_end(self, args: Any, state: Any, control: Any, **more: Any) -> None:
        # A value is a mean since the last one. With one at each checkpoint, a run that continues
        # from there has the same means as one that was never interrupted.
        if control.should_save:
            control.should_log = True
        begin(f"training: update {state.global_step:,} of {state.max_steps:,}")

    def on_log(self, args: Any, state: Any, control: Any, logs: Any = None, **more: Any) -> None:
        if "loss" not in logs:
            return
        now, seen = time.monotonic(), self._trainer.tokens
        rate = (seen - self._tokens) * args.world_size / max(now - self._since, 1e-9)
        each = (now - self._since) / max(state.global_step - self._update, 1)
        self._update, self._since, self._tokens = state.global_step, now, seen
        line = {
            "update": state.global_step,
            "epoch": round(state.epoch, 4),
            "loss": logs["loss"],
            "learning_rate": logs["learning_rate"],
            "gradient_norm": logs.get("grad_norm"),
            "tokens_per_second": round(rate, 1),
            "memory": machine.used_memory(),
        }
        with (self._run.path / METRICS).open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")
        for name, value in line.items():
            if name != "update" and value is not None:
                self._board.add_scalar(name, value, state.global_step)
        self._board.flush()
        if not math.isfinite(logs["loss"]):
            raise ValueError(
                f"the loss is {logs['loss']} at update {state.global_step}; set a lower "
                "training.learning_rate, and start anew in another --out"
            )
        left = (state.max_steps - state.global_step) * each
        self._report(
            Progress(state.global_step, state.max_steps, logs["loss"], rate, left, line["memory"])
        )

    def on_train_end(self, args: Any, state: Any, control: Any, **more: Any) -> None:
        self._board.close()
