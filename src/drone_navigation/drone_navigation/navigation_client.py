"""The navigation client: ``ros2 run drone_navigation navigation_client``.

The modules of a command are imported when the command line has been read: a help text or a mistake
needs no ROS, and only files and the autopilot's storage need the MAVLink codec.
"""

from __future__ import annotations

from drone_navigation.process_control.quiet_start import run_program

# isort: split
import argparse
import sys

from drone_navigation.client.option_groups.storage_options import STORAGE_COMMANDS
from drone_navigation.client.options import (
    COURSE_GOAL_M,
    EXIT_CANCELED,
    EXIT_SUCCESS,
    EXIT_USAGE,
    GIMBAL_COMMANDS,
    LOG_COMMANDS,
    SERVICE_COMMANDS,
    make_parser,
    parse_options,
)

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
    if options.command in GIMBAL_COMMANDS:
        from drone_navigation.client.payload.gimbal import run_point  # noqa: PLC0415

        return run_point(options, argv)
    if options.command in STORAGE_COMMANDS:
        from drone_navigation.client.storage import run_storage_command  # noqa: PLC0415

        return run_storage_command(options, argv)
    if options.command in LOG_COMMANDS:
        from drone_navigation.client.logs import run_log_command  # noqa: PLC0415

        return run_log_command(options, argv)
    if not (options.command or options.goal or options.plan or options.waypoints):
        code = _look(options, argv)
        if code != EXIT_SUCCESS or not _wants_course_goal():
            return code or EXIT_USAGE
        options.goal = list(COURSE_GOAL_M)
    from drone_navigation.client.session import run_goal  # noqa: PLC0415

    return run_goal(options, argv)


def _look(options: argparse.Namespace, argv: list[str]) -> int:
    """Show the help and the state of the vehicle: no target was given, and none is guessed."""
    from drone_navigation.client.commands import run_command  # noqa: PLC0415

    if not options.json:
        print(make_parser().format_help(), flush=True)
    look = argparse.Namespace(**{**vars(options), "command": "status"})
    code = run_command(look, argv)
    if not options.json:
        print("No target was given, and nothing was sent.", flush=True)
    return code


def _wants_course_goal() -> bool:
    """Ask on a terminal whether to fly to the goal of the course, as its own client does."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return False
    x, y, z = COURSE_GOAL_M
    try:
        answer = input(f"Fly to the goal of the course, ({x:g}, {y:g}, {z:g}) m? [y/N] ")
    except EOFError:
        return False
    return answer.strip().lower() in ("y", "yes")


if __name__ == "__main__":
    sys.exit(main())
