"""Start simulator and server: ``ros2 launch drone_navigation simulation.launch.py``."""

import sys
from pathlib import Path

from launch import LaunchDescription
from launch.actions import ExecuteProcess, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource


def generate_launch_description() -> LaunchDescription:
    """Return the simulated copter and a server that listens to it."""
    server = Path(__file__).with_name("navigation_server.launch.py")
    return LaunchDescription(
        [
            ExecuteProcess(cmd=[sys.executable, "-m", "mavlink_sitl"], output="screen"),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(server))),
        ]
    )
