"""Seeded scenarios of fleets, and the commands that fly them."""
