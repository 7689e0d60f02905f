"""The navigation client: ``ros2 run drone_navigation navigation_client``.

The modules of a command are imported when the command line has been read: a help text or a mistake
needs no ROS, and only files and the autopilot's storage need the MAVLink codec.
"""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import sys

from drone_navigation.client.options import (
    EXIT_CANCELED,
    LOG_COMMANDS,
    SERVICE_COMMANDS,
    parse_options,
)
from drone_navigation.client.storage_options import STORAGE_COMMANDS

_ROS_ARGUMENTS = "--ros-args"


def main(args: list[str] | None = None) -> int:
    """Send a goal or run a command, and return the exit code."""
    return run_program("navigation_client", args, _main, EXIT_CANCELED, "Interrupted.")


def _main(argv: list[str]) -> int:
    own = argv[1:]
    if _ROS_ARGUMENTS in argv:
        from drone_navigation.process_control.ros_arguments import own_arguments  # noqa: PLC0415

        own = own_arguments(argv)
    options = parse_options(own)
    if options.command in SERVICE_COMMANDS:
        from drone_navigation.client.commands import run_command  # noqa: PLC0415

        return run_command(options, argv)
    if options.command in STORAGE_COMMANDS:
        from drone_navigation.client.storage import run_storage_command  # noqa: PLC0415

        return run_storage_command(options, argv)
    if options.command in LOG_COMMANDS:
        from drone_navigation.client.logs import run_log_command  # noqa: PLC0415

        return run_log_command(options, argv)
    from drone_navigation.client.session import run_goal  # noqa: PLC0415

    return run_goal(options, argv)


if __name__ == "__main__":
    sys.exit(main())
