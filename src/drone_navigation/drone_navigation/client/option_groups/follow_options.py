"""Options of ``navigation_client follow`` and ``navigation_client land``, which have a target."""

from __future__ import annotations

import argparse
import math

from navigation_core.geometry import Vector3

__all__ = ["add_follow", "add_landing"]

_SYSTEM_MAX, _RETRIES_MAX = 255, 255


def add_follow(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument(
        "--topic",
        default="",
        metavar="NAME",
        help="topic of the target's poses: PoseStamped, PoseWithCovarianceStamped or Odometry",
    )
    source.add_argument("--tf", default="", metavar="FRAME", help="frame of TF of the target")
    source.add_argument(
        "--system",
        type=_system,
        default=0,
        metavar="N",
        help="MAVLink system that sends FOLLOW_TARGET or GLOBAL_POSITION_INT",
    )
    parser.add_argument(
        "--offset",
        type=_offset,
        required=True,
        metavar="X,Y,Z",
        help="from the target to the place that is kept, metres: --offset=-6,0,4 is behind and "
        "above",
    )
    parser.add_argument(
        "--offset-frame",
        choices=("target", "map"),
        default="target",
        help="axes of the offset: forward, left, up of the target (default), or east, north, up",
    )
    for name, metavar, words in (
        ("--least-distance", "M", "never nearer to the target (default: the server's clearance)"),
        ("--speed", "M_S", "max_speed (default: the server's)"),
        ("--duration", "S", "end with success after this time (default: until it is cancelled)"),
        ("--target-timeout", "S", "end after this time without the target (default: 10)"),
    ):
        parser.add_argument(name, type=float, default=0.0, metavar=metavar, help=words)
    parser.add_argument(
        "--yaw-mode",
        choices=("target", "tangent", "keep"),
        default="target",
        help="yaw: to the target (default), in the direction of travel, or as it is",
    )


def add_landing(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "--on",
        default="",
        metavar="TOPIC",
        help="topic of a target's poses: PoseStamped, PoseWithCovarianceStamped or Odometry",
    )
    parser.add_argument(
        "--required", action="store_true", help="hold instead of landing without the target"
    )
    parser.add_argument(
        "--retries",
        type=_retries,
        default=0,
        metavar="N",
        help="climb and search again this often once the target is lost (default: 0)",
    )
    parser.add_argument(
        "--search-height",
        type=float,
        default=0.0,
        metavar="M",
        help="height above the ground at which it searches (default: as high as it is)",
    )


def _system(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= _SYSTEM_MAX:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number from 1 to {_SYSTEM_MAX}")
    return int(text)


def _offset(text: str) -> Vector3:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(math.isfinite(part) for part in (x, y, z)):
        raise argparse.ArgumentTypeError(f"'{text}' is not X,Y,Z in metres")
    return (x, y, z)


def _retries(text: str) -> int:
    if not text.isdecimal() or int(text) > _RETRIES_MAX:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number from 0 to {_RETRIES_MAX}")
    return int(text)
