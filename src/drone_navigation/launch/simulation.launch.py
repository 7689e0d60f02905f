"""Start simulator and server: ``ros2 launch drone_navigation simulation.launch.py``."""

import sys
from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration


def generate_launch_description() -> LaunchDescription:
    """Return a simulated vehicle and a server that listens to it.

    ``config``, a parameter file, is the server's; without one it takes the simulator's set-up.
    """
    server = Path(__file__).with_name("navigation_server.launch.py")
    simulator = [sys.executable, "-m", "mavlink_sitl"]
    for name in ("vehicle", "autopilot"):
        simulator += [f"--{name}", LaunchConfiguration(name)]
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "vehicle", default_value="copter", description="copter, rover, boat or plane"
            ),
            DeclareLaunchArgument(
                "autopilot", default_value="ardupilot", description="ardupilot or px4"
            ),
            ExecuteProcess(cmd=simulator, output="screen"),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(server))),
        ]
    )
