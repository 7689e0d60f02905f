"""The command line of ``navigation_client``."""

from __future__ import annotations

import argparse
import difflib
import math
from pathlib import Path

from drone_navigation.client.option_groups.follow_options import add_follow, add_landing
from drone_navigation.client.option_groups.storage_options import (
    STORAGE_CODES,
    STORAGE_COMMANDS,
    add_storage,
    check_storage,
)
from drone_navigation.client.option_groups.survey_options import add_survey
from drone_navigation.client.updates import Update, UpdateError, parse_update
from drone_navigation.client.watch import LOST_TIMEOUT_S, SILENCE_S
from flight_logs.command_version import add_version
from navigation_bridge.configuration.parameter_values import ConfigurationError, check_vehicle_names
from navigation_bridge.goals.requests import LAPS_MAX

EXIT_SUCCESS = 0
EXIT_ABORTED = 1
EXIT_USAGE = 2
EXIT_REJECTED = 3
EXIT_CANCELED = 4
EXIT_NO_SERVER = 5

ACTION_COMMANDS = {
    "follow": "keep a place beside a target that moves",
    "orbit": "fly or drive a circle around a point",
    "survey": "cover an area by parallel lines, with photos if a camera is given",
    "takeoff": "take off and hold at a height",
    "land": "land where the vehicle is, or on a target",
    "return": "return to the launch point; aircraft land there",
}
SERVICE_COMMANDS = {
    "hold": "end the active goal and hold",
    "pause": "pause the active goal",
    "resume": "resume a paused goal",
    "arm": "arm the vehicle",
    "disarm": "disarm the vehicle",
    "mode": "set the vehicle's mode",
    "photo": "take a photo",
    "status": "show vehicle, position, battery and active goal",
}
LOG_COMMANDS = {
    "logs": "list the autopilot's own logs",
    "download": "download one of them to the server's machine",
}
GIMBAL_COMMANDS = {
    "point": "point the gimbal",
}
COMMANDS = ACTION_COMMANDS | SERVICE_COMMANDS | GIMBAL_COMMANDS | STORAGE_COMMANDS | LOG_COMMANDS

_UINT32_END = 2**32

_DESCRIPTION = """\
Send a goal to navigate_to_waypoint, or a route from a file to navigate_waypoints, show the
progress and wait for the result. Without a target nothing is sent: this help and the vehicle's
state are shown, and on a terminal the goal of the course, 10 5 2, is offered.

Ctrl-C cancels the goal and waits for the vehicle to stop; a second Ctrl-C stops waiting. Keys on a
terminal: p pauses, r resumes, g enters another goal, which replaces the active one, c cancels,
? shows help.
"""
_EPILOG = """\
commands (each has its own --help):
{commands}

examples:
  navigation_client takeoff --height 5
  navigation_client follow --topic /target --offset=-6,0,4
  navigation_client orbit 30 10 --radius 12 --laps 2
  navigation_client survey --boundary "0,0 60,0 60,40 0,40" --height 20 --spacing 8
  navigation_client land --on /target --required --retries 2
  navigation_client status --json
  navigation_client --goal 10 5 2 --avoid
  navigation_client --goal 10 5 2 --update "t=8: 5 5 2" --update "t=15: 0 0 2"
  navigation_client --plan my.plan --speed 3
  navigation_client --vehicle a --goal 10 5 2
  navigation_client --goal 10 5 2 --json | jq 'select(.event == "ended")'

{codes}
With --update and g, the result of the last goal counts.
"""
_CODES = """\
exit codes:
  0  succeeded
  1  aborted, or waiting was interrupted (a second Ctrl-C)
  2  invalid command line or file; nothing was sent
  3  the goal, or one of --update, was rejected
  4  canceled
  5  no server, or the connection to it was lost"""
_SERVICE_CODES = """\
exit codes:
  0  done
  2  invalid command line; nothing was sent
  3  rejected, with the reason
  5  no server, or it did not answer"""
_DOWNLOAD_CODES = """\
Ctrl-C cancels. What was downloaded is kept, and the same command resumes it.

exit codes:
  0  downloaded
  1  ended early, or waiting was interrupted (a second Ctrl-C)
  2  invalid command line; nothing was sent
  3  rejected, with the reason
  4  canceled
  5  no server, or it did not answer"""
COURSE_GOAL_M = (10.0, 5.0, 2.0)
"""The goal that the client of the course flies to, in the map, ENU"""
_FLIGHT = {"--update": "update", "--yaw": "yaw", "--speed": "speed", "--avoid": "avoid"}
LATEST_LOG = 65535
"""DownloadLog.Goal.LATEST"""


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of ``navigation_client``."""
    parser = argparse.ArgumentParser(
        prog="navigation_client",
        description=_DESCRIPTION,
        epilog=_EPILOG.format(
            commands="\n".join(f"  {name:<10} {what}" for name, what in COMMANDS.items()),
            codes=_CODES,
        ),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_version(parser, "drone_navigation")
    parser.set_defaults(command="")
    _add_goal(parser)
    _add_course(parser)
    _add_output(parser)
    return parser


def make_command_parser(command: str) -> argparse.ArgumentParser:
    """Return the command line of ``navigation_client COMMAND``."""
    is_action = command in ACTION_COMMANDS
    what = COMMANDS[command]
    codes = _CODES if is_action else _SERVICE_CODES
    if command in STORAGE_COMMANDS:
        codes = STORAGE_CODES
    elif command == "download":
        codes = _DOWNLOAD_CODES
    parser = argparse.ArgumentParser(
        prog=f"navigation_client {command}",
        description=f"{what[0].upper()}{what[1:]}.",
        epilog=codes,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=command, update=[], frame="map", mission=False)
    parser.set_defaults(first=1, interrupted=0, yaw_rate=0.0)
    if command != "orbit":
        parser.set_defaults(laps=1)
    _add_vehicle(parser)
    _add_own(parser, command)
    if is_action:
        # Those of goals that are typed meanwhile.
        parser.set_defaults(yaw=None)
        if command == "follow" or command == "survey":
            parser.set_defaults(avoid=None)
        elif command != "orbit":
            parser.set_defaults(speed=0.0, avoid=None)
        _add_following(parser)
    else:
        _add_server_timeout(parser)
    _add_output(parser)
    return parser


def _add_own(parser: argparse.ArgumentParser, command: str) -> None:
    """Add the options that only this command has."""
    if command == "orbit":
        _add_orbit(parser)
    elif command == "follow":
        add_follow(parser)
    elif command == "survey":
        add_survey(parser)
    elif command == "takeoff":
        parser.add_argument(
            "--height",
            type=_height,
            default=0.0,
            metavar="M",
            help="height above the ground (default: the server's takeoff_height_m)",
        )
    elif command == "point":
        _add_point(parser)
    elif command == "land":
        add_landing(parser)
    elif command == "mode":
        parser.add_argument("mode", metavar="MODE", help="the firmware's own name: GUIDED, ...")
    elif command in STORAGE_COMMANDS:
        add_storage(parser, command)
    elif command == "download":
        parser.add_argument(
            "log_id",
            type=_log_id,
            nargs="?",
            default=LATEST_LOG,
            metavar="LOG",
            help="number of the log, as `logs` shows it (default: the newest)",
        )


def _add_output(parser: argparse.ArgumentParser) -> None:
    output = parser.add_mutually_exclusive_group()
    output.add_argument("--plain", action="store_true", help="print plain lines even on a terminal")
    output.add_argument(
        "--json",
        action="store_true",
        help="for scripts: one JSON object per line on standard output, and nothing else",
    )


def _add_vehicle(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--vehicle",
        type=_vehicle,
        metavar="NAME",
        help="name of the vehicle, if a server has several",
    )


def _add_goal(parser: argparse.ArgumentParser) -> None:
    _add_vehicle(parser)
    what = parser.add_mutually_exclusive_group()
    what.add_argument(
        "--goal",
        nargs=3,
        type=float,
        metavar=("X", "Y", "Z"),
        help="target in metres",
    )
    what.add_argument(
        "--plan", type=Path, metavar="FILE", help="fly the route of a file: .plan or QGC WPL"
    )
    what.add_argument("--waypoints", type=Path, metavar="FILE", help="the same as --plan")
    parser.add_argument(
        "--mission", action="store_true", help="fly the route as a mission of the autopilot"
    )
    parser.add_argument(
        "--laps", type=int, metavar="N", help="number of times the route is flown (default: 1)"
    )
    parser.add_argument(
        "--first",
        type=int,
        metavar="N",
        help="waypoint to begin with, from 1 over all laps: continues an interrupted route",
    )
    parser.add_argument(
        "--interrupted",
        type=int,
        default=0,
        metavar="ID",
        help="route_id of that route, so that another one is rejected",
    )
    parser.add_argument(
        "--yaw-rate",
        type=float,
        default=0.0,
        metavar="RAD_S",
        help="turn rate kept while a copter flies the route, counter-clockwise, rad/s",
    )
    _add_frame(parser)
    parser.add_argument(
        "--yaw",
        type=float,
        metavar="DEG",
        help="yaw at the target, counter-clockwise from east; "
        "default: face the direction of travel",
    )
    _add_speed(parser)


def _add_frame(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--frame",
        default="map",
        help="frame of the target: map (ENU, default), base_link (FLU), "
        "or wgs84 (latitude, longitude, metres above sea level)",
    )


def _add_speed(parser: argparse.ArgumentParser) -> None:
    """Add the options of how something is flown."""
    parser.add_argument(
        "--speed", type=float, default=0.0, metavar="M_S", help="max_speed (default: the server's)"
    )
    avoidance = parser.add_mutually_exclusive_group()
    avoidance.add_argument(
        "--avoid",
        action="store_true",
        default=None,
        help="avoid obstacles (default where the vehicle has sensors or known obstacles)",
    )
    avoidance.add_argument(
        "--straight",
        dest="avoid",
        action="store_false",
        default=None,
        help="do not avoid obstacles: fly straight, through them",
    )


def _add_orbit(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "x", type=_finite, metavar="X", help="centre: east (forward, latitude), in the frame"
    )
    parser.add_argument(
        "y", type=_finite, metavar="Y", help="centre: north (left, longitude), in the frame"
    )
    parser.add_argument(
        "--radius",
        type=_finite,
        required=True,
        metavar="M",
        help="radius; positive is anticlockwise seen from above, negative clockwise",
    )
    parser.add_argument(
        "--height",
        type=_finite,
        default=math.nan,
        metavar="M",
        help="height above the ground (default: the present one, or that of a take-off)",
    )
    parser.add_argument(
        "--laps",
        type=_finite,
        default=1.0,
        metavar="N",
        help="number of laps; 0 is until it is cancelled (default: 1)",
    )
    parser.add_argument(
        "--yaw-mode",
        choices=("centre", "tangent", "keep"),
        default="centre",
        help="yaw on the circle: to the centre (default), in the direction of travel, or as it is",
    )
    _add_frame(parser)
    _add_speed(parser)


def _add_point(parser: argparse.ArgumentParser) -> None:
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        "--angle",
        nargs=2,
        type=_finite,
        metavar=("PITCH", "YAW"),
        help="degrees above the horizon (-90: straight down), and counter-clockwise from the nose",
    )
    where.add_argument(
        "--at", nargs=3, type=_finite, metavar=("X", "Y", "Z"), help="a position, kept in view"
    )
    where.add_argument(
        "--system", type=_system, metavar="ID", help="another vehicle, by its MAVLink system"
    )
    where.add_argument(
        "--release", action="store_true", help="back to the gimbal's default, for others to point"
    )
    parser.add_argument(
        "--locked", action="store_true", help="with --angle: YAW is from east, and kept"
    )
    _add_frame(parser)


def _system(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= 255:
        raise argparse.ArgumentTypeError(f"'{text}' is not a MAVLink system, 1 to 255")
    return int(text)


def _add_course(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--update",
        action="append",
        type=_update,
        default=[],
        metavar='"t=S: X Y Z"',
        help="S seconds after the first goal was accepted, replace the active goal, or "
        "continue from a goal already reached. May be repeated",
    )
    _add_following(parser)


def _add_following(parser: argparse.ArgumentParser) -> None:
    """Add the options of all goals."""
    parser.add_argument(
        "--cancel-after",
        type=float,
        default=math.inf,
        metavar="S",
        help="cancel S seconds after the first goal was accepted",
    )
    _add_server_timeout(parser)
    parser.add_argument(
        "--lost-timeout",
        type=float,
        default=LOST_TIMEOUT_S,
        metavar="S",
        help="timeout for a server that goes silent during a goal; at least "
        f"{SILENCE_S:g} (default: {LOST_TIMEOUT_S:g})",
    )


def _add_server_timeout(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--server-timeout",
        type=float,
        default=10.0,
        metavar="S",
        help="timeout for finding the server (default: 10)",
    )


def _check_target(parser: argparse.ArgumentParser, options: argparse.Namespace) -> None:
    """End with a sentence if target, route and their options do not fit each other."""
    is_route = options.plan is not None or options.waypoints is not None
    for name, given in (
        ("--mission", options.mission),
        ("--laps", options.laps is not None),
        ("--first", options.first is not None),
        ("--interrupted", bool(options.interrupted)),
        ("--yaw-rate", bool(options.yaw_rate)),
    ):
        if given and not is_route:
            parser.error(f"{name} needs a route; give --plan or --waypoints as well.")
    needs_target = [flag for flag, name in _FLIGHT.items() if getattr(options, name)]
    if options.goal is None and not is_route and needs_target:
        parser.error(f"{needs_target[0]} needs a target; give --goal X Y Z, or --plan FILE.")
    options.laps = 1 if options.laps is None else options.laps
    if not 0 <= options.laps <= LAPS_MAX:
        parser.error(f"--laps is {options.laps}; give 1 to {LAPS_MAX}.")
    options.first = 1 if options.first is None else options.first
    for name, least in (("first", 1), ("interrupted", 0)):
        number = getattr(options, name)
        if not least <= number < _UINT32_END:
            parser.error(f"--{name} is {number}; give {least} or more, at most 32 bits.")


def parse_options(arguments: list[str]) -> argparse.Namespace:
    """Return the options; an error ends the program with a message and EXIT_USAGE.

    A command, if there is one, comes first, or after options that all commands have.
    """
    arguments = _command_first(arguments)
    if arguments and arguments[0] in COMMANDS:
        parser = make_command_parser(arguments[0])
        options = parser.parse_args(arguments[1:])
        check_storage(parser, options)
    else:
        if arguments and not arguments[0].startswith("-"):
            near = difflib.get_close_matches(arguments[0], COMMANDS, 1)
            advice = f"did you mean '{near[0]}'?" if near else f"give one of {', '.join(COMMANDS)}."
            make_parser().error(f"'{arguments[0]}' is not a command; {advice}")
        parser = make_parser()
        options = parser.parse_args(arguments)
        _check_target(parser, options)
    for name in ("cancel_after", "server_timeout", "lost_timeout"):
        value = getattr(options, name, 0.0)
        if not value >= 0.0:
            flag = f"--{name.replace('_', '-')}"
            parser.error(f"{flag} is {value:g}; give a number of seconds, 0 or more.")
    options.update.sort(key=lambda update: update.at_s)
    return options


def _command_first(arguments: list[str]) -> list[str]:
    """Return arguments with the command before options that precede it."""
    before = argparse.ArgumentParser(add_help=False, allow_abbrev=False, exit_on_error=False)
    _add_vehicle(before)
    _add_following(before)
    _add_output(before)
    before.add_argument("rest", nargs=argparse.REMAINDER)
    try:
        known, others = before.parse_known_args(arguments)
    except argparse.ArgumentError:
        return arguments  # the command's own parser reports it
    rest: list[str] = known.rest
    # Another option may have the name of a command as its value.
    if others or not rest or rest[0] not in COMMANDS:
        return arguments
    return [*rest[:1], *arguments[: len(arguments) - len(rest)], *rest[1:]]


def _finite(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"'{text}' is not a number")
    return value


def _height(text: str) -> float:
    try:
        height_m = float(text)
    except ValueError:
        height_m = math.nan
    if not 0.0 < height_m < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a height above 0 m")
    return height_m


def _log_id(text: str) -> int:
    if not text.isdecimal() or int(text) >= LATEST_LOG:
        raise argparse.ArgumentTypeError(f"'{text}' is not the number of a log")
    return int(text)


def _vehicle(text: str) -> str:
    try:
        check_vehicle_names(text.strip("/").split("/"))
    except ConfigurationError:
        raise argparse.ArgumentTypeError(f"'{text}' is not a valid vehicle name") from None
    return text.strip("/")


def _update(text: str) -> Update:
    try:
        return parse_update(text)
    except UpdateError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
