"""Writers of thoughts: a row of :data:`agents.expert.writers.registry.WRITERS` each."""
