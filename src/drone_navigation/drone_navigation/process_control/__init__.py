"""Starts of nodes without noise and on any rclpy, and their end on a signal."""
