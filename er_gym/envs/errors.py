"""What environments raise that Gymnasium has no name for."""

from __future__ import annotations

import gymnasium


class ResetNeeded(gymnasium.error.ResetNeeded):
    """Something was asked of an episode, and no episode is under way; the message says why."""
