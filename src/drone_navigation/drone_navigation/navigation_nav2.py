"""Nav2's actions and services for its clients: ``ros2 run drone_navigation navigation_nav2``."""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import importlib.util
import sys

import rclpy
from rclpy.signals import SignalHandlerOptions

from drone_navigation.process_control.ros_arguments import own_arguments
from drone_navigation.process_control.ros_start import starting_ros
from drone_navigation.process_control.stop_signals import StopSignals
from flight_logs.command_version import add_version

EXIT_OK = 0
EXIT_FAILED = 1
_PARAMETERS = {
    "least_height_m": 0.0,
    "max_speed_m_s": 0.0,
    "avoid_obstacles": True,
    "waypoint_pause_s": 0.2,
    "follow_distance_m": 5.0,
    "follow_height_m": 4.0,
}


def make_parser() -> argparse.ArgumentParser:
    """Return the command line."""
    parser = argparse.ArgumentParser(
        prog="navigation_nav2",
        description="Offer Nav2's actions, services and topics to its clients (BasicNavigator, "
        "RViz's 2D Goal Pose) and fly their goals with a navigation_server. For a vehicle with a "
        "namespace add --ros-args -r __ns:=/NAME.",
        epilog="parameters (as --ros-args -p NAME:=VALUE): "
        + ", ".join(f"{name} ({str(value).lower()})" for name, value in _PARAMETERS.items()),
    )
    add_version(parser, "drone_navigation")
    return parser


def main(args: list[str] | None = None) -> int:
    """Serve Nav2's clients until a signal; return the exit code."""
    return run_program("navigation_nav2", args, _main, EXIT_OK)


def _main(argv: list[str]) -> int:
    make_parser().parse_args(own_arguments(argv))
    if importlib.util.find_spec("nav2_msgs") is None:
        print(
            "nav2_msgs is not built: run scripts/setup.sh --with nav2_msgs, or install "
            "ros-$ROS_DISTRO-nav2-msgs.",
            file=sys.stderr,
        )
        return EXIT_FAILED
    # Imported here because they import nav2_msgs, whose absence is reported above.
    from drone_navigation.nav2.forms import too_old  # noqa: PLC0415

    if reason := too_old():
        print(reason, file=sys.stderr)
        return EXIT_FAILED
    from drone_navigation.nav2.node import StartError, run  # noqa: PLC0415

    signals = StopSignals("navigation_nav2")
    code = EXIT_OK
    with starting_ros():
        rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    try:
        run(signals, _PARAMETERS)
    except StartError as error:
        print(str(error), file=sys.stderr)
        code = EXIT_FAILED
    finally:
        rclpy.try_shutdown()
    signals.finish(code)
    return code


if __name__ == "__main__":
    sys.exit(main())
