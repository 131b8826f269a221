"""Clauses read as claims, and judged against what the agent knows: true, false or unknown."""
