"""Recorded flights: telemetry logs read in bulk and exported, without ROS."""
