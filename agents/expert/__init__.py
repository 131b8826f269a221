"""The expert: it knows where objects are, acts as if it had to search, and writes thoughts."""
