"""Start simulator and server: ``ros2 launch drone_navigation simulation.launch.py``."""

import sys
from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description() -> LaunchDescription:
    """Return a simulated vehicle and a server that listens to it.

    ``config``, a parameter file, is the server's; without one it takes the simulator's set-up.
    """
    server = Path(__file__).with_name("navigation_server.launch.py")
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "vehicle", default_value="copter", description="copter, rover, boat or plane"
            ),
            DeclareLaunchArgument(
                "autopilot", default_value="ardupilot", description="ardupilot or px4"
            ),
            DeclareLaunchArgument(
                "mark",
                default_value="",
                description="NORTH,EAST of a mark to land on, which a camera sees; "
                "navigation_target publishes it on /target",
            ),
            OpaqueFunction(function=_simulated),
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(server))),
        ]
    )


def _simulated(context: LaunchContext) -> list[ExecuteProcess | Node]:
    names = ("vehicle", "autopilot", "mark")
    vehicle, autopilot, mark = (LaunchConfiguration(name).perform(context) for name in names)
    simulator = [sys.executable, "-m", "mavlink_sitl"]
    simulator += ["--vehicle", vehicle, "--autopilot", autopilot]
    if not mark:
        return [ExecuteProcess(cmd=simulator, output="screen")]
    simulator.append(f"--mark={mark}")
    if (vehicle, autopilot) == ("copter", "ardupilot"):
        # An ArduCopter takes no targets without these.
        simulator += ["--param", "PLND_ENABLED=1", "--param", "PLND_TYPE=1"]
    target = Node(package="drone_navigation", executable="navigation_target", output="screen")
    return [ExecuteProcess(cmd=simulator, output="screen"), target]
