"""Wrappers: the instruction as a vector, reward shaping, faults, and ``info`` without texts.

::

    env = gymnasium.make("ER-SinglePickup-v0", obs_mode="state")
    env = KeyActionShaping(InstructionEmbedding(env), gamma=0.99)

Each works on what ``gymnasium.make`` returns and on an ``EmbodiedEnv`` as it is, in any order.
Large packages are imported only when an encoder that needs them is made.
"""

from er_gym.envs.wrappers.encoders import Encoder, make_encoder
from er_gym.envs.wrappers.faults import FaultInjection
from er_gym.envs.wrappers.instruction import InstructionEmbedding
from er_gym.envs.wrappers.numbers_only import NumbersOnly
from er_gym.envs.wrappers.shaping import KeyActionShaping

__all__ = [
    "Encoder",
    "FaultInjection",
    "InstructionEmbedding",
    "KeyActionShaping",
    "NumbersOnly",
    "make_encoder",
]
