"""A model's reply, read as an action and the thoughts before it."""

from agents.vlm.parsing.reply import ParsedReply, parse
from agents.vlm.parsing.tags import Thought

__all__ = ["ParsedReply", "Thought", "parse"]
