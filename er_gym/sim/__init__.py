"""The embedded engine: iTHOR scenes, their state and AI2-THOR's actions, in numpy."""
