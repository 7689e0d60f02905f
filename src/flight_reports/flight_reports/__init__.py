"""Reports, plots and videos of recorded flights. No ROS."""
