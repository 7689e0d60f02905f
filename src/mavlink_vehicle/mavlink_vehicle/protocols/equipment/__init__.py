"""Cameras, gimbals, grippers and servo outputs of the vehicle."""
