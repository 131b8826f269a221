"""Faults that change nothing that a user or another part can see, judged by hand."""

from __future__ import annotations

from collections.abc import Mapping

EQUIVALENT: Mapping[str, str] = {}
"""The reason, by the id of the fault."""
