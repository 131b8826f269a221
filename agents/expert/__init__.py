"""The expert: it knows where things are, acts as if it had to search, and says why."""
