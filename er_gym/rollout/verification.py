"""Makes a verifier with an environment of its own, for worker processes."""

from __future__ import annotations

from er_gym.envs.embodied_env import verification_env
from er_gym.envs.verify import Verifier


def make_verifier() -> Verifier:
    """A verifier on an embedded engine of its own."""
    return Verifier(verification_env())
