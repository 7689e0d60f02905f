"""The command line of ``navigation_server``. No ROS."""

from __future__ import annotations

import argparse
import math

from navigation_bridge.configuration.parameter_table import PARAMETERS, ParameterValue

CHECK_TIMEOUT_S = 15.0
"""For how long --check looks at most, unless it is told"""


def make_parser() -> argparse.ArgumentParser:
    """Return the command line of ``navigation_server``."""
    width = max(len(spec.name) for spec in PARAMETERS)
    listing = "\n".join(
        f"  {spec.name:<{width}}  {spec.description} (default: {_shown(spec.default)})"
        for spec in PARAMETERS
    )
    parser = argparse.ArgumentParser(
        prog="navigation_server",
        description="ROS 2 action server that flies navigation goals on a MAVLink "
        "autopilot. Without --link and --config it takes the simulator's set-up: it listens "
        "on udpin://127.0.0.1:14550 and may arm the vehicle.",
        epilog="parameters (in a --config file, or as --ros-args -p NAME:=VALUE):\n" + listing,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--config", metavar="FILE", help="ROS parameter file (YAML)")
    parser.add_argument("--link", metavar="URL", help="parameter link_url")
    parser.add_argument("--arming", choices=("auto", "pilot", "never"), help="parameter arming")
    parser.add_argument("--tlog", metavar="FILE", help="parameter record_tlog")
    parser.add_argument(
        "--check",
        action="store_true",
        help="look at vehicle and link, say what was found and what a goal lacks, and end: 0 "
        "ready, 1 not ready, 2 no vehicle or a bad set-up; sends nothing that moves anything",
    )
    parser.add_argument(
        "--timeout",
        metavar="S",
        type=_seconds,
        help=f"longest time that --check looks, in seconds (default {CHECK_TIMEOUT_S:g})",
    )
    parser.add_argument(
        "--shadow-goals",
        metavar="FILE",
        help="with --link tlog:PATH, work on the goals of a YAML file against the recording, print "
        "what would have become of them, and end: 0 all succeed, 1 not all, 2 a bad file; sends "
        "nothing",
    )
    parser.add_argument(
        "--json", action="store_true", help="let --check or --shadow-goals print JSON"
    )
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
    """Return the parameters that options of their own set."""
    given = {"link_url": options.link, "arming": options.arming, "record_tlog": options.tlog}
    return {name: value for name, value in given.items() if value is not None}
