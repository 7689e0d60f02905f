"""The autopilot's own logs in ROS: service and action of the server, and their files."""
