"""Ablations: what each part of the training is worth, by leaving it out."""
