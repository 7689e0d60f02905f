"""Uploaded plans: missions, fences and rally points."""
