"""The high-level verbs of the paper, spelled as its files spell them, and one more, "slice".

Plain strings, because they are what files, models and people write. An action is a verb, alone
(:data:`BARE_VERBS`) or with an object type (:data:`OBJECT_VERBS`).
"""

from __future__ import annotations

NAVIGATE = "navigate to"
PICKUP = "pickup"
PUT = "put in"
OPEN = "open"
CLOSE = "close"
TOGGLE = "toggle"
SLICE = "slice"
"""Ours, not the paper's: needs a knife in the hand."""
OBSERVE = "observe"
MOVE_FORWARD = "move forward"
END = "end"
INIT = "init"
"""Not an action: the name of an episode's first recorded step, in which the agent is placed."""

BARE_VERBS = (OBSERVE, MOVE_FORWARD, END)
OBJECT_VERBS = (NAVIGATE, PICKUP, PUT, OPEN, CLOSE, TOGGLE, SLICE)
INTERACTIONS = (PICKUP, PUT, OPEN, CLOSE, TOGGLE, SLICE)
"""Verbs that change the object they name."""

UNSCORED = frozenset({INIT, OBSERVE, MOVE_FORWARD, NAVIGATE})
"""Verbs that success does not ask for: how one gets about is the agent's own affair."""

ALIASES = {"put": PUT, "pick up": PICKUP, "navigate": NAVIGATE, "go to": NAVIGATE, "cut": SLICE}


def canonical_verb(verb: str) -> str:
    """The spelling used here of a verb as files write it ("put" and "put in" are one verb)."""
    verb = " ".join(verb.lower().split())
    return ALIASES.get(verb, verb)
