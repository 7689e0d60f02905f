"""What a firmware knows of itself: estimate, sticks, limits, and how its parts see it."""
