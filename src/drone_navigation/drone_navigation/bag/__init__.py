"""Recordings as MCAP files of ROS messages."""
