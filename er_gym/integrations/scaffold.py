"""The scaffold of a session: how much the observation tells, and what is rewarded.

One switch for all plugs, ``"OBSERVATION/REWARD"``: ``"hints/key_actions"`` is what
``gymnasium.make(…, obs_mode="text")`` tells and rewards, ``"picture/success"`` the barest.
"""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.envs.observations import TEXTS

OBSERVATIONS: dict[str, str] = dict(
    zip(("picture", "caption", "targets", "hints"), TEXTS, strict=True)
)
"""How much the text tells, to the observation that holds it. Each tells what the one before tells,
and more:

- ``picture``: the task, the steps, and whether the last action worked; the rest is in the picture;
- ``caption``: what is in view, and in the hand;
- ``targets``: what may be navigated to, and what is within reach;
- ``hints``: why an action did not work.
"""
REWARDS: tuple[str, ...] = ("success", "key_actions", "shaping")
"""What is rewarded:

- ``success``: 1 for an episode that ends in success, and nothing else;
- ``key_actions``: the environment's own reward, for each key action and for the right end;
- ``shaping``: that, and the potential of
  :class:`~er_gym.envs.wrappers.shaping.KeyActionShaping`, for training only.
"""
DEFAULT = "hints/key_actions"


@dataclass(frozen=True)
class Scaffold:
    """A level of help.

    Attributes:
        observation: a key of :data:`OBSERVATIONS`.
        reward: one of :data:`REWARDS`.
    """

    observation: str
    reward: str

    @staticmethod
    def named(name: str) -> Scaffold:
        """The scaffold of a name, such as ``"caption/success"``.

        Either part alone will do; the other one is then that of :data:`DEFAULT`.

        Raises:
            ValueError: there is no such level.
        """
        observation, reward = DEFAULT.split("/")
        parts = name.split("/") if isinstance(name, str) else [""]
        if len(parts) == 1:
            parts = [observation, *parts] if parts[0] in REWARDS else [*parts, reward]
        known = len(parts) == 2 and parts[0] in OBSERVATIONS and parts[1] in REWARDS
        if not known:
            raise ValueError(
                f"unknown scaffold {name!r:.80}; give OBSERVATION/REWARD, such as {DEFAULT!r}, of "
                f"{', '.join(OBSERVATIONS)} and {', '.join(REWARDS)}"
            )
        return Scaffold(*parts)

    def __str__(self) -> str:
        return f"{self.observation}/{self.reward}"
