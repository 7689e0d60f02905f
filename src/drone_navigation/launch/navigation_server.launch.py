"""Start the navigation server: ``ros2 launch drone_navigation navigation_server.launch.py``.

``ros2 launch drone_navigation navigation_server.launch.py --show-args`` lists the arguments.
"""

from pathlib import Path

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from navigation_bridge.configuration.parameter_file import names_of_vehicles
from navigation_bridge.configuration.parameter_values import ConfigurationError

RESPAWN_DELAY_S = 2.0
# From SIGTERM to SIGKILL. The server takes up to 5 s to stop its vehicles, then ROS has to end.
KILLED_AFTER_S = 15.0
SWITCH = ("false", "true")
LEVELS = ("debug", "info", "warn", "error", "fatal")
ARGUMENTS = (
    ("config", "", None, "ROS parameter file; without it and link, the simulator's set-up"),
    ("link", "", None, "URL of the link to the vehicle, instead of the file's"),
    ("namespace", "", None, "namespace of all nodes; the parameter file must name it, or use /**"),
    ("nav2", "false", SWITCH, "serve clients of Nav2, too, for each vehicle"),
    ("console", "false", SWITCH, "serve the page for browsers, too; its address is logged"),
    ("respawn", "false", SWITCH, "start a node again that has ended; no goal is resumed"),
    ("log_level", "info", LEVELS, "least severe messages to log"),
    ("use_sim_time", "false", SWITCH, "stamp messages by /clock"),
    (
        "autostart",
        "true",
        SWITCH,
        "whether the server activates itself; false: a manager does",
    ),
)
"""Name, default, choices and description"""


def generate_launch_description() -> LaunchDescription:
    """Return the server with its arguments, and the nodes beside it that are asked for."""
    declared = [
        DeclareLaunchArgument(name, default_value=default, choices=choices, description=text)
        for name, default, choices, text in ARGUMENTS
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=_nodes)])


def _nodes(context: LaunchContext) -> list[Node]:
    value = {name: LaunchConfiguration(name).perform(context) for name, *_ in ARGUMENTS}
    of_ros = ["--log-level", value["log_level"]]
    if value["use_sim_time"] == "true":
        of_ros += ["-p", "use_sim_time:=true"]
    server = [
        word for name in ("config", "link") if value[name] for word in (f"--{name}", value[name])
    ]
    waits = [] if value["autostart"] == "true" else ["-p", "autostart:=false"]
    wanted = [("navigation_server", value["namespace"], server)]
    if value["nav2"] == "true":
        for name in _vehicles(value["config"]):
            namespace = "/".join(filter(None, (value["namespace"], name)))
            wanted.append(("navigation_nav2", namespace, []))
    if value["console"] == "true":
        wanted.append(("navigation_console", value["namespace"], ["--no-browser"]))
    return [
        Node(
            package="drone_navigation",
            executable=executable,
            namespace=namespace,
            arguments=arguments,
            ros_arguments=of_ros + (waits if executable == "navigation_server" else []),
            respawn=value["respawn"] == "true",
            respawn_delay=RESPAWN_DELAY_S,
            sigkill_timeout=str(KILLED_AFTER_S),
            output="screen",
        )
        for executable, namespace, arguments in wanted
    ]


def _vehicles(config: str) -> tuple[str, ...]:
    """Return the namespace of each vehicle below that of the server; empty for a single vehicle."""
    try:
        return (config and names_of_vehicles(Path(config))) or ("",)
    except ConfigurationError:
        return ("",)  # the server reads the file, too, and reports what is wrong with it
