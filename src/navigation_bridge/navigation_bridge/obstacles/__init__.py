"""Obstacle sources, combined in the map frame."""
