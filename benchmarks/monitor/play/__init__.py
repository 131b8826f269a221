"""A person plays: alone, or in place of an agent that they watch."""
