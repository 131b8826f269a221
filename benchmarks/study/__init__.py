"""Plans: commands of er-gym that run one after another, each once, also after interruptions."""
