"""The values that the page shows, as JSON objects. Unknown is None; lengths are metres."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, TypedDict

JsonObject: TypeAlias = dict[str, Any]
"""An object that was read from JSON, or a value of the page that another part reads"""

Tell: TypeAlias = Callable[[dict[str, object]], None]
"""Sends a page a message"""


class StatusValue(TypedDict):
    """Mode, armed and so on."""

    connected: bool
    autopilot: str
    firmware: str
    mode: str
    armed: bool
    in_control: bool
    landed: str | None
    position_valid: bool
    failsafe: str
    return_share: float | None
    reserve: float | None
    other_server: bool


class InterruptedValue(TypedDict):
    """An interrupted route: the waypoint where it continues, from 1, and how many it has in all."""

    next: int
    waypoints: int


class MotionValue(TypedDict):
    """Position in the map, attitude (rad, yaw from east), ground speed and climb rate (m/s)."""

    at: list[float]
    yaw: float | None
    roll: float | None
    pitch: float | None
    speed: float | None
    climb: float | None


class BatteryValue(TypedDict):
    """Charge (%) and voltage (V)."""

    percent: float | None
    voltage: float | None


class FixValue(TypedDict):
    """Whether there is a fix, where (degrees), and the standard deviation of the position."""

    fixed: bool
    accuracy: float | None
    latitude: float | None
    longitude: float | None


class HomeValue(TypedDict):
    """The launch point: degrees and altitude above mean sea level, and in the map."""

    latitude: float | None
    longitude: float | None
    altitude: float | None
    at: list[float] | None


class AreaValue(TypedDict):
    """An area of a fence: points in the map, places in degrees; a radius makes it a circle."""

    inclusion: bool
    stored: bool
    in_force: bool
    radius: float | None
    points: list[list[float]]
    places: list[list[float]]


class FenceValue(TypedDict):
    """A fence or the flight volume, heights above home."""

    areas: list[AreaValue]
    one_suffices: bool
    low: float | None
    high: float | None


class ItemValue(TypedDict):
    """An item of a mission, or a rally point.

    `at` is in the map, None without a place, its height None where unknown. `values` are the
    seven parameters as stored.
    """

    number: int
    command: int
    name: str
    frame: int
    at: list[float | None] | None
    values: list[float | None]


class ItemsValue(TypedDict):
    """A mission with its current item, or the rally points."""

    current: int
    items: list[ItemValue]


class DiagnosticValue(TypedDict):
    """Level and message of one part."""

    level: str
    message: str
    satellites: str | None
    lost: str | None
    round_trip: str | None


class TargetValue(TypedDict):
    """A target that is followed: whether it is known where it is, where, its distance and age (s).

    Lengths are metres, the position is in the map.
    """

    state: str
    at: list[float] | None
    distance: float | None
    age: float | None


class FeedbackValue(TypedDict):
    """Feedback of any action; distance in m, time in s."""

    action: str
    status: str
    distance: float | None
    time: float | None
    target: TargetValue | None
    replans: int | None
    waypoint: int | None
    waypoints_left: int | None
    lap: int | None


class RouteValue(TypedDict):
    """A goal of a page: the page, the action, the waypoints in the map with hold times (s)."""

    by: str
    action: str
    waypoints: list[list[float]]


class ReplayValue(TypedDict):
    """The position in a recording and its length in s, speed as a factor of real time."""

    position: float | None
    duration: float | None
    speed: float | None
    paused: bool
    ended: bool
    seeking: bool
    jumps: int
