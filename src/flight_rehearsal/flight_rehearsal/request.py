"""A request for a rehearsal: checked, with missing values filled in."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from navigation_bridge.configuration.checked_values import (
    FLAG,
    OBJECT,
    TEXT,
    Kind,
    RecordMember,
    items,
    maybe,
    number,
    record,
    row,
    whole,
)
from navigation_core.geometry import Vector3

__all__ = [
    "STEP_KINDS",
    "HomePoint",
    "RehearsalRequest",
    "RehearsalStep",
    "RehearsalWaypoint",
    "RequestError",
    "read_request",
]

STEP_KINDS = ("takeoff", "go", "route", "orbit", "wait", "return", "land")
"""The kinds of steps of a plan"""

_PERCENT = 100.0


class RequestError(ValueError):
    """Nothing can be rehearsed; the text says why, for people."""


@dataclass(frozen=True)
class RehearsalWaypoint:
    """A waypoint: ENU metres in the map; hold time in s, 0 to fly through."""

    position_enu_m: Vector3
    hold_time_s: float = 0.0


@dataclass(frozen=True)
class RehearsalStep:
    """A step of a plan.

    Attributes:
        kind: one of `STEP_KINDS`.
        points_enu_m: where to: a place, the waypoints of a route, or the centre of a circle.
        height_m: above the ground, of a take-off or circle; None: as it is.
        radius_m: of a circle, negative clockwise.
        laps: of a circle.
        seconds: of a wait.
        speed_m_s: highest ground speed; 0: the server's default.
        avoid_obstacles: whether obstacles are to be avoided.
    """

    kind: str
    points_enu_m: tuple[Vector3, ...] = ()
    height_m: float | None = None
    radius_m: float = 0.0
    laps: float = 1.0
    seconds: float = 0.0
    speed_m_s: float = 0.0
    avoid_obstacles: bool = False


@dataclass(frozen=True)
class HomePoint:
    """The launch point: degrees, metres above mean sea level, and in the map, ENU metres."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float
    position_enu_m: Vector3


@dataclass(frozen=True)
class RehearsalRequest:
    """A goal, a route, a circle or a plan, and where and how the vehicle is.

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
        radius_m: radius of a circle around the first waypoint, negative clockwise; 0: none.
        server: the server's parameters, by name; others have their defaults.
        parameters: those of the vehicle, by name; others have the simulator's defaults.
        wind_enu_m_s: velocity of the air.
        posts: known obstacles as rows of x, y, radius, bottom, top.
        boxes: known obstacles as rows of x, y, half length, half width, yaw (rad), bottom, top.
        post_names: names of the posts, as far as they have any.
        box_names: names of the boxes, as far as they have any.
        sensed: obstacles that sensors have seen, as rows like those of posts.
        lose_link: whether a loss of the link is rehearsed, too.
        steps: of a plan, which is then flown instead of the waypoints.
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
    radius_m: float = 0.0
    server: Mapping[str, Any] | None = None
    parameters: Mapping[str, float] | None = None
    wind_enu_m_s: Vector3 = (0.0, 0.0, 0.0)
    posts: tuple[tuple[float, ...], ...] = ()
    boxes: tuple[tuple[float, ...], ...] = ()
    post_names: tuple[str, ...] = ()
    box_names: tuple[str, ...] = ()
    sensed: tuple[tuple[float, ...], ...] = ()
    lose_link: bool = True
    steps: tuple[RehearsalStep, ...] = ()


def _home(
    latitude: float | None = None,
    longitude: float | None = None,
    altitude: float | None = None,
    at: Vector3 | None = None,
) -> HomePoint | None:
    if latitude is None or longitude is None or altitude is None or at is None:
        return None
    return HomePoint(latitude, longitude, altitude, at)


def _request(
    waypoints: tuple[tuple[float, float, float, float], ...] = (),
    status: dict[str, Any] | None = None,
    motion: dict[str, Any] | None = None,
    battery: float | None = None,
    consumption_per_s: float | None = None,
    obstacles: dict[str, Any] | None = None,
    parameters: dict[str, Any] | None = None,
    wind: Vector3 | None = None,
    **more: Any,
) -> RehearsalRequest:
    at = (motion or {}).get("at")
    if at is None or motion is None or not status or not status.get("position_valid"):
        raise RequestError("The vehicle's position is not known.")
    if not waypoints and not more.get("steps"):
        raise RequestError("There is neither a waypoint nor a step.")
    seen, armed = obstacles or {}, status.get("armed", False)
    return RehearsalRequest(
        autopilot=status.get("autopilot", ""),
        waypoints=tuple(RehearsalWaypoint((x, y, z), hold_s) for x, y, z, hold_s in waypoints),
        position_enu_m=at,
        yaw_enu_rad=motion.get("yaw") or 0.0,
        velocity_enu_m_s=motion.get("velocity") or (0.0, 0.0, 0.0),
        armed=armed,
        flying=armed and status.get("landed") != "on the ground",
        battery=None if battery is None else min(max(battery / _PERCENT, 0.0), 1.0),
        consumption_per_s=consumption_per_s if 0.0 < (consumption_per_s or 0.0) <= 1.0 else None,
        parameters=_finite(parameters or {}),
        wind_enu_m_s=wind or (0.0, 0.0, 0.0),
        posts=seen.get("posts", ()),
        boxes=seen.get("boxes", ()),
        post_names=seen.get("post_names", ()),
        box_names=seen.get("box_names", ()),
        sensed=seen.get("seen", ()),
        **more,
    )


def _finite(values: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(v) for name, v in values.items() if v is not None and math.isfinite(v)}


_VECTOR = row(number(), number(), number())
_NUMBER, _POINT = RecordMember(maybe(number())), RecordMember(maybe(_VECTOR))
_POSTS = RecordMember(items(row(*[number()] * 5)))
_NAMES = RecordMember(items(TEXT))
_STATUS: Kind[dict[str, Any]] = record(
    dict,
    is_open=True,
    autopilot=RecordMember(TEXT),
    armed=RecordMember(FLAG),
    landed=RecordMember(maybe(TEXT)),
    position_valid=RecordMember(FLAG),
)
_MOTION: Kind[dict[str, Any]] = record(dict, is_open=True, at=_POINT, yaw=_NUMBER, velocity=_POINT)
_HOME = record(
    _home, is_open=True, latitude=_NUMBER, longitude=_NUMBER, altitude=_NUMBER, at=_POINT
)
_OBSTACLES: Kind[dict[str, Any]] = record(
    dict,
    is_open=True,
    posts=_POSTS,
    seen=_POSTS,
    boxes=RecordMember(items(row(*[number()] * 7))),
    post_names=_NAMES,
    box_names=_NAMES,
)


def _step(kind: str, **more: Any) -> RehearsalStep:
    if kind not in STEP_KINDS:
        raise RequestError(f"There is no step {kind!r}.")
    step = RehearsalStep(kind, **more)
    if kind in ("go", "route", "orbit") and not step.points_enu_m:
        raise RequestError(f"The step {kind!r} has no place.")
    return step


_STEP = record(
    _step,
    is_open=True,
    kind=RecordMember(TEXT, required=True),
    points_enu_m=RecordMember(items(_VECTOR), name="points"),
    height_m=RecordMember(maybe(number()), name="height"),
    radius_m=RecordMember(number(), name="radius"),
    laps=RecordMember(number(0), name="laps"),
    seconds=RecordMember(number(0)),
    speed_m_s=RecordMember(number(0), name="speed"),
    avoid_obstacles=RecordMember(FLAG, name="avoid"),
)
REQUEST = record(
    _request,
    is_open=True,
    waypoints=RecordMember(items(row(*[number()] * 4))),
    steps=RecordMember(items(_STEP)),
    status=RecordMember(maybe(_STATUS)),
    motion=RecordMember(maybe(_MOTION)),
    battery=_NUMBER,
    consumption_per_s=RecordMember(maybe(number()), name="consumption"),
    home=RecordMember(maybe(_HOME)),
    obstacles=RecordMember(maybe(_OBSTACLES)),
    server=RecordMember(maybe(OBJECT)),
    parameters=RecordMember(maybe(OBJECT)),
    wind=_POINT,
    speed_m_s=RecordMember(number(0), name="speed"),
    laps=RecordMember(whole(1)),
    avoid_obstacles=RecordMember(FLAG, name="avoid"),
    radius_m=RecordMember(number(), name="radius"),
    lose_link=RecordMember(FLAG),
)
"""Members of a line of JSON, by the console's names; others are ignored."""


def read_request(text: str) -> RehearsalRequest:
    """Return the order that a line of JSON has.

    Raises:
        RequestError: it is not one, or says too little of the vehicle.
    """
    try:
        return REQUEST.read(json.loads(text))
    except RequestError:
        raise
    except (ValueError, TypeError, RecursionError) as error:
        raise RequestError(f"The request cannot be read: {error}") from error
