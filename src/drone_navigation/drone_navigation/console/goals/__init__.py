"""Goals and routes of pages as ROS messages."""
