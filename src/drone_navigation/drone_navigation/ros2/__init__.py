"""The commands of ``ros2`` for a machine whose ROS has none: graph, values, and each command."""
