"""Figures and events of a recorded flight."""
