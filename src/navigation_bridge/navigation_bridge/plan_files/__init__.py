"""Files of ground stations, read as items and as the waypoints of a route."""
