"""A request for a rehearsal: checked, with missing values filled in."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from navigation_core.geometry import Vector3

__all__ = ["HomePoint", "RehearsalRequest", "RehearsalWaypoint", "RequestError", "read_request"]

_PERCENT = 100.0


class RequestError(ValueError):
    """Nothing can be rehearsed; the text says why, for people."""


@dataclass(frozen=True)
class RehearsalWaypoint:
    """A waypoint: ENU metres in the map; hold time in s, 0 to fly through."""

    position_enu_m: Vector3
    hold_time_s: float = 0.0


@dataclass(frozen=True)
class HomePoint:
    """The launch point: degrees, metres above mean sea level, and in the map, ENU metres."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    position_enu_m: Vector3


@dataclass(frozen=True)
class RehearsalRequest:
    """A goal or a route, and where and how the vehicle is.

    Attributes:
        autopilot: name of the firmware and the kind, as the server's status has it.
        waypoints: where to; one without a hold time is a goal.
        position_enu_m: where the vehicle is in the map.
        yaw_enu_rad: its heading, counter-clockwise from east.
        velocity_enu_m_s: its velocity.
        armed: whether its motors are armed.
        flying: whether it is off the ground.
        battery: charge from 0 to 1; None if it is unknown.
        consumption_per_s: share of the battery that a second under way takes, as flown; None
            before that was measured.
        home: its launch point, or None.
        speed_m_s: highest ground speed; 0: the server's default.
        laps: how often the route is flown.
        avoid_obstacles: whether obstacles are to be avoided.
        server: the server's parameters, by name; others have their defaults.
        parameters: those of the vehicle, by name; others have the simulator's defaults.
        wind_enu_m_s: velocity of the air.
        posts: obstacles as rows of x, y, radius, bottom, top.
        boxes: obstacles as rows of x, y, half length, half width, yaw (rad), bottom, top.
    """

    autopilot: str
    waypoints: tuple[RehearsalWaypoint, ...]
    position_enu_m: Vector3 = (0.0, 0.0, 0.0)
    yaw_enu_rad: float = 0.0
    velocity_enu_m_s: Vector3 = (0.0, 0.0, 0.0)
    armed: bool = False
    flying: bool = False
    battery: float | None = 1.0
    consumption_per_s: float | None = None
    home: HomePoint | None = None
    speed_m_s: float = 0.0
    laps: int = 1
    avoid_obstacles: bool = False
    server: Mapping[str, Any] | None = None
    parameters: Mapping[str, float] | None = None
    wind_enu_m_s: Vector3 = (0.0, 0.0, 0.0)
    posts: tuple[tuple[float, ...], ...] = ()
    boxes: tuple[tuple[float, ...], ...] = ()


def read_request(text: str) -> RehearsalRequest:
    """Return the order that a line of JSON has; unknown members are ignored.

    Raises:
        RequestError: it is not one, or says too little of the vehicle.
    """
    try:
        given = json.loads(text)
        return _order(given)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        if isinstance(error, RequestError):
            raise
        raise RequestError(f"The request cannot be read: {error!r}.") from error


def _order(given: dict[str, Any]) -> RehearsalRequest:
    motion, status = given.get("motion"), given.get("status")
    if not motion or not status or not status.get("position_valid"):
        raise RequestError("The vehicle's position is not known.")
    obstacles = given.get("obstacles") or {}
    percent = given.get("battery")
    home = given.get("home")
    flying = status.get("landed") != "on the ground" and bool(status.get("armed"))
    return RehearsalRequest(
        autopilot=str(status.get("autopilot", "")),
        waypoints=tuple(_waypoint(row) for row in given["waypoints"]),
        position_enu_m=_vector(motion["at"]),
        yaw_enu_rad=float(motion.get("yaw") or 0.0),
        velocity_enu_m_s=_vector(motion.get("velocity") or (0.0, 0.0, 0.0)),
        armed=bool(status.get("armed")),
        flying=flying,
        battery=None if percent is None else min(max(percent / _PERCENT, 0.0), 1.0),
        consumption_per_s=_positive(given.get("consumption")),
        home=_home(home) if home and home.get("at") else None,
        speed_m_s=float(given.get("speed", 0.0)),
        laps=int(given.get("laps", 1)),
        avoid_obstacles=bool(given.get("avoid")),
        server=dict(given.get("server") or {}),
        parameters=_finite(given.get("parameters") or {}),
        wind_enu_m_s=_vector(given.get("wind") or (0.0, 0.0, 0.0)),
        # Obstacles seen by sensors are posts in the bridge's map, too.
        posts=_rows([*obstacles.get("posts", ()), *obstacles.get("seen", ())]),
        boxes=_rows(obstacles.get("boxes", ())),
    )


def _waypoint(row: Any) -> RehearsalWaypoint:
    x, y, z, hold_s = (float(value) for value in row)
    return RehearsalWaypoint((x, y, z), hold_s)


def _home(home: dict[str, Any]) -> HomePoint | None:
    place = tuple(home.get(name) for name in ("latitude", "longitude", "altitude"))
    if None in place:
        return None
    latitude, longitude, altitude = (float(value) for value in place)  # type: ignore[arg-type]
    return HomePoint(latitude, longitude, altitude, _vector(home["at"]))


def _vector(value: Any) -> Vector3:
    x, y, z = (float(each) for each in value)
    if not all(map(math.isfinite, (x, y, z))):
        raise RequestError("A position or velocity is not known.")
    return x, y, z


def _finite(values: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(v) for name, v in values.items() if v is not None and math.isfinite(v)}


def _rows(rows: Any) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(value) for value in row) for row in rows)


def _positive(value: Any) -> float | None:
    return float(value) if value is not None and 0.0 < float(value) <= 1.0 else None
