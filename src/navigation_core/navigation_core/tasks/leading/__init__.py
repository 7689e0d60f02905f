"""Guidance of a vehicle along its path: trajectories, setpoints and obstacle avoidance."""
