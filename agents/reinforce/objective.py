"""The objective: PPO's clipped ratio, with a divergence from the start and an entropy."""

from __future__ import annotations

from dataclasses import dataclass

import torch

from agents.reinforce.settings import ObjectiveSettings
from agents.vlm.clients.seeded_sampling import never_drawn


@dataclass(frozen=True)
class TokenScores:
    """What a model says of the tokens that are learnt, (learnt tokens,) each.

    Attributes:
        chance: the logarithm of the token's probability.
        entropy: of the distribution from which the token was drawn.
    """

    chance: torch.Tensor
    entropy: torch.Tensor


def token_scores(
    logits: torch.Tensor,
    wanted: torch.Tensor,
    temperature: float,
    *,
    never: int | None = None,
    of_entropy: bool = False,
) -> TokenScores:
    """The scores of tokens.

    Args:
        logits: (learnt tokens, words) from which each token was drawn.
        wanted: (learnt tokens,) the tokens.
        temperature: at which they were drawn.
        never: a token that is never drawn; None if any may be.
        of_entropy: whether the entropy has a gradient, which takes memory.
    """
    scores = logits.float() / temperature
    if never is not None:
        never_drawn(scores, never)
    chances = scores.log_softmax(dim=1)
    with torch.set_grad_enabled(torch.is_grad_enabled() and of_entropy):
        entropy = -(chances.exp() * chances).sum(dim=1)
    return TokenScores(chances.gather(1, wanted[:, None])[:, 0], entropy)


def losses(
    now: TokenScores,
    at_play: torch.Tensor,
    at_start: torch.Tensor | None,
    advantage: torch.Tensor,
    settings: ObjectiveSettings,
) -> tuple[torch.Tensor, dict[str, torch.Tensor]]:
    """What is minimised for each token, and figures of each for the log; (learnt tokens,) all.

    Args:
        now: of the model as it is.
        at_play: the logarithm of the probability at play.
        at_start: that of the model at the start; None where ``kl`` is 0.
        advantage: of the token's turn.
        settings: of the objective.
    """
    difference = now.chance - at_play
    ratio = difference.exp()
    high = settings.clip if settings.clip_high is None else settings.clip_high
    clipped = ratio.clamp(1 - settings.clip, 1 + high)
    found = -torch.minimum(ratio * advantage, clipped * advantage)
    told = {
        "clipped": (ratio * advantage > clipped * advantage).float(),
        "moved": -difference.detach(),  # its mean estimates the divergence from the model at play
        "entropy": now.entropy.detach(),
    }
    if at_start is not None:
        apart = at_start - now.chance
        divergence = apart.exp() - apart - 1  # never negative (Schulman's k3)
        found = found + settings.kl * divergence
        told["kl"] = divergence.detach()
    if settings.entropy:
        found = found - settings.entropy * now.entropy
    return found, told
