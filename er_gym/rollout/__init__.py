"""Play episodes: the agent protocol, records, processes, threads, and the run directory."""
