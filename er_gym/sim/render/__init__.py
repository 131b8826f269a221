"""Pictures of the embedded engine's world, drawn on the CPU."""
