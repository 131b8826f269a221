"""Fine-tunes language and vision-language models on trajectories, in the paper's three stages."""
