"""Learns from the rows of an update: forward, backward, and the optimizer's steps."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import replace
from typing import Any

import accelerate
import numpy as np
import torch

from agents.finetune.batches import Collator
from agents.finetune.loop import LearntOnly
from agents.finetune.optimizer import MuonAdamW
from agents.reinforce.objective import TokenScores, losses, token_scores
from agents.reinforce.rows import Batch, Row, batch_of, batches, in_steps
from agents.reinforce.settings import ReinforceSettings, TrainingSettings


class Learner:
    """The model that learns, with its optimizer.

    Args:
        network: the model; of its weights those learn that need a gradient.
        start: the model as it was at the start, for ``objective.kl``; None where that is the
            network without its adapter.
        settings: of the run.
        accelerator: spreads the work over processes and devices.
        collator: makes batches, with the model's pictures.
        rounded: whether it is multiplied in bfloat16.

    Attributes:
        optimizer: with its state.
    """

    def __init__(
        self,
        network: Any,
        start: Any,
        settings: ReinforceSettings,
        accelerator: accelerate.Accelerator,
        collator: Collator,
        *,
        rounded: bool = False,
    ) -> None:
        self._settings, self._accelerator = settings, accelerator
        self._collator, self._rounded = collator, rounded
        self._inner, self._start = network, start
        self._learnt_only = LearntOnly(network)
        self._start_only = None if start is None else LearntOnly(start)
        self._network = accelerator.prepare_model(network)
        self._learning = [each for each in network.parameters() if each.requires_grad]
        self.optimizer = _optimizer(network, settings.training)

    def learn(self, rows: Sequence[Row], update: int) -> dict[str, float]:
        """Learn from the rows of an update that this process has; all processes call it together.

        Returns:
            figures for the log: of tokens, the mean over all that are learnt by all processes.
        """
        training, process = self._settings.training, self._accelerator.process_index
        several = training.passes * training.steps > 1
        if not self._sum(len(rows)):
            return {}
        for group in self.optimizer.param_groups:
            group["lr"] = rate_of(training, update)
        self._network.train()
        if several and any(np.isnan(row.scores).any() for row in rows):
            rows = self._scored_again(rows)
        told: dict[str, float] = defaultdict(float)
        norms: list[float] = []
        for number in range(training.passes):
            seed = (training.seed, update, number, process)
            for places in in_steps(len(rows), training.steps, seed):
                norms += self._step([rows[place] for place in places], several, not norms, told)
        figures = {name: self._sum(value) for name, value in sorted(told.items())}
        known, tokens = figures.pop("known", 0.0), figures.pop("tokens", 0.0)
        gap = figures.pop("sampler_gap", 0.0)
        means = {name: value / max(tokens, 1.0) for name, value in figures.items()}
        if known:
            means["sampler_gap"] = gap / known
        return {
            **means,
            "learnt_tokens": tokens,
            "gradient_norm": float(np.mean(norms)) if norms else 0.0,
            "learning_rate": rate_of(training, update),
        }

    def _step(
        self, rows: Sequence[Row], several: bool, fresh: bool, told: dict[str, float]
    ) -> list[float]:
        """One step of the optimizer; gives the norm of its gradient, or nothing without tokens.

        Args:
            rows: what it learns from.
            several: whether the update has more steps than this.
            fresh: whether the model is as it was at play.
            told: sums of figures, to which those of this step are added.
        """
        accelerator = self._accelerator
        weight = self._sum(sum(float(row.weight[row.learnt].sum()) for row in rows))
        if not weight:
            return []
        *most, last = self._in_batches(rows)
        for batch in (*most, last):
            # Gradients are averaged over processes, and once for all batches.
            with nullcontext() if batch is last else accelerator.no_sync(self._network):
                loss = self._loss(batch, several, fresh, told) * accelerator.num_processes / weight
                accelerator.backward(loss)
        norm = accelerator.clip_grad_norm_(self._learning, self._settings.training.max_grad_norm)
        self.optimizer.step()
        self.optimizer.zero_grad()
        return [float(norm)]

    def _loss(
        self, batch: Batch, several: bool, fresh: bool, told: dict[str, float]
    ) -> torch.Tensor:
        """The weighted sum over a batch's tokens, not yet divided by the weight of all."""
        objective = self._settings.objective
        now = self._scores(batch)
        # In an update of one step the model is as it was at play, exactly.
        at_play = batch.scores if several else now.chance.detach()
        at_start = self._scores_at_start(batch) if objective.kl else None
        each, figures = losses(now, at_play, at_start, batch.advantage, objective)
        if fresh:
            apart = (now.chance.detach() - batch.scores).abs()
            known = apart.isfinite()
            told["known"] += float(known.sum())
            told["sampler_gap"] += float(apart[known].sum())
        told["tokens"] += len(each)
        told["loss"] += float(each.detach().sum())
        for name, values in figures.items():
            told[name] += float(values.sum())
        return (each * batch.weight).sum()

    def _scores(self, batch: Batch) -> TokenScores:
        with self._learnt_only.at(batch.labels), self._multiplied():
            logits = self._network(**batch.inputs, use_cache=False).logits[0]
        return self._of_tokens(logits, batch, of_entropy=bool(self._settings.objective.entropy))

    @torch.no_grad()
    def _scores_at_start(self, batch: Batch) -> torch.Tensor:
        with ExitStack() as stack:
            network = self._start
            if self._start_only is not None:
                stack.enter_context(self._start_only.at(batch.labels))
            else:
                network = self._inner
                stack.enter_context(network.disable_adapter())
                stack.enter_context(self._learnt_only.at(batch.labels))
            stack.enter_context(self._multiplied())
            logits = network(**batch.inputs, use_cache=False).logits[0]
        return self._of_tokens(logits, batch).chance

    def _of_tokens(
        self, logits: torch.Tensor, batch: Batch, *, of_entropy: bool = False
    ) -> TokenScores:
        return token_scores(
            logits,
            batch.wanted,
            self._settings.play.temperature,
            never=self._collator.image_token,
            of_entropy=of_entropy,
        )

    @torch.no_grad()
    def _scored_again(self, rows: Sequence[Row]) -> list[Row]:
        """The rows with what the network says of their tokens now."""
        found: dict[int, Row] = {}
        for places in batches([len(row.ids) for row in rows], self._settings.training.batch):
            chances = self._scores(self._batch(rows, places)).chance.cpu().numpy()
            ends = np.cumsum([rows[place].learnt.sum() for place in places])
            for place, part in zip(places, np.split(chances, ends[:-1]), strict=True):
                scores = rows[place].scores.copy()
                scores[rows[place].learnt] = part
                found[place] = replace(rows[place], scores=scores)
        return [found[place] for place in range(len(rows))]

    def _in_batches(self, rows: Sequence[Row]) -> Iterator[Batch]:
        """At least one batch: all processes step together, with or without rows."""
        every = [*batches([len(row.ids) for row in rows], self._settings.training.batch)]
        for places in every or [[]]:
            yield self._batch(rows, places)

    def _batch(self, rows: Sequence[Row], places: Sequence[int]) -> Batch:
        made = batch_of([rows[place] for place in places], self._collator)
        return made.on(self._accelerator.device)

    def _multiplied(self) -> torch.autocast:
        device = self._accelerator.device.type
        return torch.autocast(device, torch.bfloat16, enabled=self._rounded)

    def _sum(self, value: float) -> float:
        """The sum over all processes."""
        if self._accelerator.num_processes == 1:
            return float(value)
        one = torch.tensor(float(value), device=self._accelerator.device)
        return float(self._accelerator.reduce(one, reduction="sum"))


def rate_of(training: TrainingSettings, update: int) -> float:
    """The learning rate of an update, from 1."""
    rate = training.learning_rate * min(1.0, update / (training.warmup + 1))
    if training.decay:
        rate *= 1 - (update - 1) / training.updates
    return rate


def _optimizer(network: Any, training: TrainingSettings) -> torch.optim.Optimizer:
    if training.optimizer == "muon":
        return MuonAdamW(network, training.learning_rate, training.weight_decay)
    learning = [each for each in network.parameters() if each.requires_grad]
    return torch.optim.AdamW(
        learning, training.learning_rate, weight_decay=training.weight_decay, fused=True
    )
