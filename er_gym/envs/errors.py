"""Exceptions of environments, beyond those of Gymnasium."""

from __future__ import annotations

import gymnasium


class ResetNeeded(gymnasium.error.ResetNeeded):
    """A call needs an episode, and no episode is under way; the message says why."""
