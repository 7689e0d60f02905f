"""The command line of ``navigation_server``. No ROS."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence

from flight_logs.command_version import add_version
from navigation_bridge.configuration.parameter_table import (
    PARAMETERS,
    SPECS,
    ParameterSpec,
    ParameterValue,
)

CHECK_TIMEOUT_S = 15.0
"""For how long --check looks at most, by default"""


def make_parser(parameters: Sequence[ParameterSpec] = PARAMETERS) -> argparse.ArgumentParser:
    """Return the command line of ``navigation_server``, whose help lists the parameters."""
    width = max(len(spec.name) for spec in parameters)
    listing = "\n".join(
        f"  {spec.name:<{width}}  {spec.description} (default: {_shown(spec.default)})"
        for spec in parameters
    )
    parser = argparse.ArgumentParser(
        prog="navigation_server",
        description="ROS 2 action server that executes navigation goals on a MAVLink "
        "autopilot. Without --link and --config it uses the simulator's set-up: it listens "
        "on udpin://127.0.0.1:14550 and may arm the vehicle.",
        epilog="parameters (in a --config file, or as --ros-args -p NAME:=VALUE):\n" + listing,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add_version(parser, "drone_navigation")
    parser.add_argument("--config", metavar="FILE", help="ROS parameter file (YAML)")
    parser.add_argument("--link", metavar="URL", help="parameter link_url")
    parser.add_argument("--arming", choices=SPECS["arming"].choices, help="parameter arming")
    parser.add_argument("--tlog", metavar="FILE", help="parameter record_tlog")
    parser.add_argument(
        "--check",
        action="store_true",
        help="check vehicle, link and this computer, report the findings, and exit: 0 "
        "ready, 1 not ready, 2 no vehicle or invalid configuration; moves nothing",
    )
    parser.add_argument(
        "--timeout",
        metavar="S",
        type=_seconds,
        help=f"timeout of --check in seconds (default: {CHECK_TIMEOUT_S:g})",
    )
    parser.add_argument(
        "--no-computer",
        action="store_true",
        help="leave out of --check the trial of this computer, which takes 12 seconds",
    )
    parser.add_argument(
        "--computer-row",
        action="store_true",
        help="try this computer as --check does, print its row for the table in docs/on_board.md, "
        "and exit",
    )
    parser.add_argument(
        "--shadow-goals",
        metavar="FILE",
        help="with --link tlog:PATH, run the goals of a YAML file against the recording, print "
        "their results, and exit: 0 all succeed, 1 not all, 2 invalid file; sends "
        "nothing",
    )
    parser.add_argument(
        "--trace-lateness",
        action="store_true",
        help="log each turn of the driver thread above 20 ms with its cause, and all at the end "
        "(docs/scaling.md)",
    )
    parser.add_argument("--json", action="store_true", help="print JSON (--check, --shadow-goals)")
    return parser


def _shown(default: ParameterValue) -> str:
    """Return a default as it is written on the command line."""
    if isinstance(default, bool):
        return str(default).lower()
    if isinstance(default, str | list | tuple) and not default:
        return "empty"
    if isinstance(default, list | tuple):
        return ", ".join(map(str, default))
    return str(default)


def _seconds(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 3600.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of seconds from 0 to 3600")
    return value


def overrides(options: argparse.Namespace) -> dict[str, ParameterValue]:
    """Return the parameters set by dedicated options."""
    given = {"link_url": options.link, "arming": options.arming, "record_tlog": options.tlog}
    return {name: value for name, value in given.items() if value is not None}
