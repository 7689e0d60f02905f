"""The ROS 2 nodes: navigation goals in, MAVLink to the vehicle out."""
