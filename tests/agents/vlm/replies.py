"""The normal form of a reply, for tests of its parser."""

from __future__ import annotations


def tagged(words: str) -> str:
    return f"<DecisionMaking>{words}</DecisionMaking>"


NORMAL = "<Observation>I see a Fridge.</Observation>\n<Planning>I go there.</Planning>\n" + tagged(
    "navigate to Fridge"
)
