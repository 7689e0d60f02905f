"""Tasks that guide the vehicle by setpoints, to a point or along a route."""
