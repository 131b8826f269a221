"""Speed and soundness of the engine and the environment: scripts, not tests."""
