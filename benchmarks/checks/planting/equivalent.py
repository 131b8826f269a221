"""Faults that change nothing that a user or another part can see, judged by hand."""

from __future__ import annotations

from collections.abc import Mapping

EQUIVALENT: Mapping[str, str] = {
    "paper_approach-2d9a97": "of a side only the sign counts: 2 is the same side as 1",
}
"""The reason, by the id of the fault."""
