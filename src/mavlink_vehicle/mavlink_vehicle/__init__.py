"""One autopilot over MAVLink, without ROS: usable alone."""
