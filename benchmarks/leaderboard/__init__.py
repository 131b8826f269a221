"""The leaderboard: runs packed into files, checked against the engine, and shown on a page."""
