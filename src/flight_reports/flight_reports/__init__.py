"""Recorded flights explained: reports, plots and films. No ROS."""
