"""Trajectories for training: records, critic, statistics, exports."""
