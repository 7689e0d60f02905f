"""Obstacles: what sensors saw, what is known, and how far everything is from it."""
