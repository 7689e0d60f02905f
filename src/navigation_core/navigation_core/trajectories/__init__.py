"""Jerk-limited trajectories."""
