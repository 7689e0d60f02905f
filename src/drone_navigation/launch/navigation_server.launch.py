"""Start the navigation server: ``ros2 launch drone_navigation navigation_server.launch.py``.

``nav2:=true`` also starts `navigation_nav2`, for clients of Nav2.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.conditions import IfCondition, UnlessCondition
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return the server with a parameter file, or with the simulator's set-up without one."""
    config = LaunchConfiguration("config")
    without = EqualsSubstitution(config, "")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "config", default_value="", description="ROS parameter file of the server"
            ),
            DeclareLaunchArgument(
                "nav2", default_value="false", description="serve clients of Nav2, too"
            ),
            Node(
                package="drone_navigation",
                executable="navigation_nav2",
                output="screen",
                condition=IfCondition(LaunchConfiguration("nav2")),
            ),
            Node(
                package="drone_navigation",
                executable="navigation_server",
                output="screen",
                condition=IfCondition(without),
            ),
            Node(
                package="drone_navigation",
                executable="navigation_server",
                output="screen",
                parameters=[config],
                condition=UnlessCondition(without),
            ),
        ]
    )
