"""Vehicle and navigation joined, without ROS: goals in, MAVLink out, feedback back."""
