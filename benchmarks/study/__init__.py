"""Plans: many commands of er-gym's, run one after another, each once, whatever happens."""
