"""Map tiles from a local file. No ROS, no network."""
