"""Obstacles, sensed and known, and the clearance to them."""
