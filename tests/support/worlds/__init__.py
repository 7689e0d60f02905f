"""Obstacles, what a sensor sees of them, how near a vehicle truly came, and other planners."""
