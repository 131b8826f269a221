"""Faults that change nothing that a user or another part can see, judged by hand."""

from __future__ import annotations

from collections.abc import Mapping

EQUIVALENT: Mapping[str, str] = {
    "paper_approach-2d9a97": "of a side only the sign counts: 2 is the same side as 1",
    "data_charts-9fc9a9": "at exactly 65 % either colour of the number can be read",
    "encoders-4bfac3": "how many texts an encoder remembers changes no vector",
}
"""The reason, by the id of the fault."""
