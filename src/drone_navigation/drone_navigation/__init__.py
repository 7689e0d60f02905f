"""ROS 2 nodes for navigation goals on a MAVLink vehicle."""
