"""Controllers and guidance over lanes."""
