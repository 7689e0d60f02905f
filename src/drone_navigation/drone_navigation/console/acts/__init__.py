"""Acts at the waypoints of a page's route."""
