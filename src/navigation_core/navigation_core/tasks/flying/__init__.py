"""Tasks that lead the vehicle themselves, to a point or along a route."""
