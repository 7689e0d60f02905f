"""State of a firmware: estimate, sticks, limits, and the views that its parts have of it."""
