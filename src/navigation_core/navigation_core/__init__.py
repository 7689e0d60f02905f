"""Trajectories, path planning and navigation tasks, without ROS or MAVLink."""
