"""Sampling with a seed for each row of a batch."""

from __future__ import annotations

from collections.abc import Sequence

import torch
import transformers

_NEVER = -1e9  # finite, so that the entropy of such scores is a number


class SeededSampling:
    """Samples the next token of each row with the row's own seed, independent of the batch.

    ``generate`` would sample all rows with one generator, so a reply would depend on the other
    conversations in the batch. Here each row's logits get Gumbel noise from the row's own
    generator: the largest sum is then a sample from the distribution (the Gumbel-max trick), and
    ``generate`` takes the largest.
    """

    def __init__(self, temperature: float, top_p: float, seeds: Sequence[int]) -> None:
        self._sampled = SampledScores(temperature, top_p)
        self._seeds = seeds
        self._sources: list[torch.Generator] = []

    def __call__(self, input_ids: torch.Tensor, scores: torch.Tensor) -> torch.Tensor:
        """Scores with noise; both (rows, words)."""
        if not self._sources:  # the device is known only now
            self._sources = [torch.Generator(scores.device).manual_seed(s) for s in self._seeds]
        noise = torch.empty_like(scores)
        for row, source in zip(noise, self._sources, strict=True):
            row.exponential_(generator=source)
        return with_noise(self._sampled(scores), noise)


class SampledScores:
    """The scores from which tokens are drawn: by the temperature, of the likeliest words alone."""

    def __init__(self, temperature: float, top_p: float) -> None:
        self._temperature = temperature
        self._likeliest = transformers.TopPLogitsWarper(top_p) if top_p < 1 else None

    def __call__(self, scores: torch.Tensor) -> torch.Tensor:
        """Both (rows, words)."""
        scores = scores / self._temperature
        if self._likeliest is not None:
            scores = self._likeliest(None, scores)
        return scores


def never_drawn(scores: torch.Tensor, token: int) -> None:
    """Change scores, (rows, words), so that a token is never drawn."""
    scores[:, token] = _NEVER


def with_noise(scores: torch.Tensor, noise: torch.Tensor) -> torch.Tensor:
    """Scores with Gumbel noise, made of exponentially distributed numbers; all (rows, words)."""
    return scores - noise.log()
