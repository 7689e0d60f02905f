"""Inputs of tasks from outside: velocities, a target, and acts at waypoints."""
