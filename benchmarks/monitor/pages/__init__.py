"""The pages of the monitor. Each file answers at some addresses."""
