"""Where to go next: trajectories, planning and tasks, without ROS or MAVLink."""
