"""ROS-free bridge between navigation goals and a MAVLink vehicle."""
