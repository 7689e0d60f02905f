"""Supervision of a flight: health, position, pilots, ground stations."""
