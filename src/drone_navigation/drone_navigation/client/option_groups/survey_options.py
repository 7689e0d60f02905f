"""Options of ``navigation_client survey``."""

from __future__ import annotations

import argparse
import math

__all__ = ["SURVEY_FRAMES", "add_survey"]

SURVEY_FRAMES = ("map", "above_home", "above_ground", "amsl")


def add_survey(parser: argparse.ArgumentParser) -> None:
    """Add the options."""
    parser.add_argument(
        "--boundary",
        type=_corners,
        required=True,
        metavar="X,Y...",
        help="corners: metres east and north, or latitude and longitude with another --frame",
    )
    parser.add_argument(
        "--hole",
        type=_corners,
        action="append",
        default=[],
        metavar="X,Y...",
        help="area that is left out and not entered; may be given several times",
    )
    parser.add_argument(
        "--frame",
        dest="survey_frame",
        choices=SURVEY_FRAMES,
        default="map",
        help="map, or latitude and longitude with heights above home, above the ground or amsl",
    )
    parser.add_argument(
        "--height", type=float, required=True, metavar="M", help="height of all waypoints"
    )
    parser.add_argument(
        "--terrain",
        metavar="FILE",
        help="heights of the ground, which --height then counts from: .asc or .npz, copters only",
    )
    parser.add_argument(
        "--spacing", type=float, default=0.0, metavar="M", help="of the lines (default: --camera's)"
    )
    parser.add_argument(
        "--camera",
        type=_three,
        metavar="W,H,F",
        help="width and height of the sensor and focal length, mm: photos by distance",
    )
    parser.add_argument(
        "--overlap",
        type=_two,
        default=(70.0, 75.0),
        metavar="SIDE,FRONT",
        help="of the photos, %% (default: 70,75)",
    )
    for name, metavar, default, words in (
        ("--angle", "DEG", math.nan, "of the lines, counter-clockwise from east (default: best)"),
        ("--overrun", "M", 0.0, "how much farther lines begin and end (default: 0)"),
        ("--radius", "M", 0.0, "within which a waypoint is reached (default: the server's)"),
        ("--speed", "M_S", 0.0, "max_speed (default: the server's)"),
    ):
        parser.add_argument(name, type=float, default=default, metavar=metavar, help=words)
    parser.add_argument(
        "--entry",
        type=_two,
        metavar="X,Y",
        help="from where the survey is begun (default: the first corner)",
    )
    parser.add_argument(
        "--first", type=int, default=1, metavar="N", help="continue at this waypoint, from 1 on"
    )
    parser.add_argument(
        "--interrupted",
        type=int,
        default=0,
        metavar="ID",
        help="route_id of the survey that continues: another one is rejected",
    )
    parser.add_argument(
        "--mission", action="store_true", help="upload a mission, which the autopilot flies"
    )


def _corners(text: str) -> tuple[tuple[float, float], ...]:
    return tuple(_two(corner) for corner in text.split())


def _two(text: str) -> tuple[float, float]:
    first, second = map(float, text.split(","))
    return first, second


def _three(text: str) -> tuple[float, float, float]:
    first, second, third = map(float, text.split(","))
    return first, second, third
