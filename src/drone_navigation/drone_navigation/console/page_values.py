"""ROS messages as values for the page. Unknown is None; lengths are metres in `map`, ENU."""

from __future__ import annotations

import math

from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import Point, Quaternion, Vector3
from nav_msgs.msg import Odometry, Path
from sensor_msgs.msg import BatteryState, NavSatFix
from visualization_msgs.msg import Marker, MarkerArray

from custom_interfaces.action import Follow, Navigate
from custom_interfaces.msg import (
    Fence,
    HomePosition,
    ReplayStatus,
    StoredItems,
    VehicleStatus,
)
from drone_navigation.console.page_types import (
    BatteryValue,
    DiagnosticValue,
    FeedbackValue,
    FenceValue,
    FixValue,
    HomeValue,
    ItemsValue,
    MotionValue,
    ReplayValue,
    StatusValue,
    TargetValue,
)
from mavlink_vehicle.protocols.operations.command import command_name

_LANDED = {
    VehicleStatus.LANDED_ON_GROUND: "on the ground",
    VehicleStatus.LANDED_IN_AIR: "in the air",
    VehicleStatus.LANDED_TAKEOFF: "taking off",
    VehicleStatus.LANDED_LANDING: "landing",
}
_LEVELS = ("ok", "warn", "error", "stale")
OBSTACLES_MAX = 4000
"""Of each kind; a page is not sent more."""


def known(value: float, digits: int = 2) -> float | None:
    """Return a number rounded, None for NaN and infinity, which JSON has not."""
    return round(float(value), digits) if math.isfinite(value) else None


def point(place: Point | Vector3) -> list[float] | None:
    """Return the three numbers of a point, None unless all are known."""
    values = (place.x, place.y, place.z)
    return [round(value, 2) for value in values] if all(map(math.isfinite, values)) else None


def status(message: VehicleStatus) -> StatusValue:
    """Return mode, armed and so on."""
    return {
        "connected": message.connected,
        "autopilot": message.autopilot,
        "firmware": message.firmware_version,
        "mode": message.mode,
        "armed": message.armed,
        "in_control": message.in_control,
        "landed": _LANDED.get(message.landed_state),
        "position_valid": message.position_valid,
        "failsafe": message.failsafe,
        "return_share": known(message.battery_for_return, 3),
        "reserve": known(message.battery_reserve, 3),
        "other_server": message.other_server,
    }


def motion(message: Odometry) -> MotionValue | None:
    """Return position, attitude (rad), ground speed and climb rate (m/s).

    Yaw is counter-clockwise from east, roll positive to the right, pitch positive with the nose up.
    """
    pose = message.pose.pose
    place = point(pose.position)
    if place is None:
        return None
    east, north, up = _turned(message.twist.twist.linear, pose.orientation)
    q = pose.orientation
    yaw_rad = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    roll_rad = math.atan2(2.0 * (q.w * q.x + q.y * q.z), 1.0 - 2.0 * (q.x * q.x + q.y * q.y))
    # Of a body with its axes forward, left and up: a turn about the left axis lowers the nose.
    nose_up = 2.0 * (q.z * q.x - q.w * q.y)
    return {
        "at": place,
        "yaw": known(yaw_rad, 3),
        "roll": known(roll_rad, 3),
        "pitch": known(math.asin(min(max(nose_up, -1.0), 1.0)), 3),
        "speed": known(math.hypot(east, north), 1),
        "climb": known(up, 1),
    }


def velocity(message: Odometry) -> list[float]:
    """Return the velocity in the map, m/s."""
    return list(_turned(message.twist.twist.linear, message.pose.pose.orientation))


def _turned(v: Vector3, q: Quaternion) -> tuple[float, float, float]:
    """Turn a vector of the body into the map."""
    tx = 2.0 * (q.y * v.z - q.z * v.y)
    ty = 2.0 * (q.z * v.x - q.x * v.z)
    tz = 2.0 * (q.x * v.y - q.y * v.x)
    return (
        v.x + q.w * tx + q.y * tz - q.z * ty,
        v.y + q.w * ty + q.z * tx - q.x * tz,
        v.z + q.w * tz + q.x * ty - q.y * tx,
    )


def battery(message: BatteryState) -> BatteryValue:
    """Return charge (%) and voltage."""
    return {"percent": known(100.0 * message.percentage, 0), "voltage": known(message.voltage, 1)}


def fix(message: NavSatFix) -> FixValue:
    """Return whether there is a fix, where (degrees), and the position's standard deviation, m."""
    variance = message.position_covariance[0]
    return {
        "fixed": message.status.status >= 0,
        "accuracy": known(math.sqrt(variance), 1) if variance > 0.0 else None,
        "latitude": known(message.latitude, 6),
        "longitude": known(message.longitude, 6),
    }


def path(message: Path) -> list[list[float]]:
    """Return the points of a path."""
    places = (point(pose.pose.position) for pose in message.poses)
    return [place for place in places if place is not None]


def home(message: HomePosition) -> HomeValue:
    """Return the launch point: geodetic, and in the map."""
    return {
        "latitude": known(message.latitude, 8),
        "longitude": known(message.longitude, 8),
        "altitude": known(message.altitude_amsl, 3),
        "at": point(message.position),
    }


def fence(message: Fence) -> FenceValue | None:
    """Return a fence or the flight volume, heights in m above home; None while unknown."""
    if not message.known:
        return None
    return {
        "areas": [
            {
                "inclusion": area.inclusion,
                "stored": area.stored,
                "in_force": area.in_force,
                "radius": known(area.radius) if area.shape == area.CIRCLE else None,
                "points": [[round(place.x, 2), round(place.y, 2)] for place in area.points],
                "places": [
                    list(place) for place in zip(area.latitudes, area.longitudes, strict=True)
                ],
            }
            for area in message.areas
        ],
        "one_suffices": message.one_suffices,
        "low": known(message.altitude_min),
        "high": known(message.altitude_max),
    }


def stored_items(message: StoredItems) -> ItemsValue | None:
    """Return mission or rally points; None while unknown.

    `at` is in the map, None without a place, its height None where unknown. `values` are the
    seven parameters as stored.
    """
    if not message.known:
        return None
    return {
        "current": message.current,
        "items": [
            {
                "number": item.number,
                "command": item.command,
                "name": command_name(item.command),
                "frame": item.frame,
                "at": None
                if math.isnan(item.position.x)
                else [known(item.position.x), known(item.position.y), known(item.position.z)],
                "values": [
                    *(known(value, 6) for value in item.params),
                    *(known(item.latitude, 7), known(item.longitude, 7), known(item.altitude, 3)),
                ],
            }
            for item in message.items
        ],
    }


def diagnostic(message: DiagnosticStatus) -> DiagnosticValue:
    """Return level and message of one part."""
    level = int.from_bytes(message.level, "little")
    values = {value.key: value.value for value in message.values}
    return {
        "level": _LEVELS[min(level, 3)],
        "message": message.message,
        "satellites": values.get("satellites"),
        "lost": values.get("lost"),
        "round_trip": values.get("round trip"),
    }


def feedback(action: str, message: Navigate.Feedback | Follow.Feedback) -> FeedbackValue:
    """Return the feedback of any action; distance in m, time in s."""
    # A target that is followed is never arrived at.
    follows = isinstance(message, Follow.Feedback)
    return {
        "action": action,
        "status": message.current_status,
        "distance": None if follows else known(message.distance_remaining, 1),
        "time": None if follows else known(message.estimated_time_remaining, 0),
        "target": _target(message) if follows else None,
        "replans": getattr(message, "replans", None),
        "waypoint": getattr(message, "current_waypoint", None),
        "waypoints_left": getattr(message, "waypoints_remaining", None),
        "lap": getattr(message, "current_lap", None),
    }


def _target(message: Follow.Feedback) -> TargetValue:
    states = {message.ACQUIRING: "ACQUIRING", message.FOLLOWING: "FOLLOWING", message.LOST: "LOST"}
    return {
        "state": states.get(message.state, ""),
        "at": point(message.target_position),
        "distance": known(message.distance, 1),
        "age": known(message.target_age, 1),
    }


def replay(message: ReplayStatus) -> ReplayValue:
    """Return where the playing of a recording is: times in s, speed as a factor of real time."""
    return {
        "position": known(message.position),
        "duration": known(message.duration),
        "speed": known(message.speed, 3),
        "paused": message.paused,
        "ended": message.ended,
        "seeking": message.seeking,
        "jumps": message.jumps,
    }


def obstacles(message: MarkerArray) -> dict[str, list[list[float]] | list[str]]:
    """Return obstacles as rows of rounded numbers, at most this many of each kind.

    Beside the rows: the names of posts and boxes, in their order.
    """
    shown: dict[str, list[list[float]] | list[str]] = {
        kind: [[round(value, 2) for value in row] for row in rows[:OBSTACLES_MAX]]
        for kind, rows in obstacle_rows(message).items()
    }
    for kind, name in ((Marker.CYLINDER, "post_names"), (Marker.CUBE, "box_names")):
        named = [m.text for m in message.markers if m.action == Marker.ADD and m.type == kind]
        shown[name] = named[:OBSTACLES_MAX]
    return shown


def obstacle_rows(message: MarkerArray) -> dict[str, list[list[float]]]:
    """Return obstacles as rows of numbers.

    Returns:
        posts: x, y, radius, bottom, top. boxes: x, y, half length, half width, yaw, bottom, top.
        seen: x, y, half width, bottom, top.
    """
    found: dict[str, list[list[float]]] = {"posts": [], "boxes": [], "seen": []}
    for marker in message.markers:
        if marker.action != Marker.ADD:
            continue
        place, size = marker.pose.position, marker.scale
        low_m, high_m = place.z - 0.5 * size.z, place.z + 0.5 * size.z
        if marker.type == Marker.CYLINDER:
            found["posts"].append([place.x, place.y, 0.5 * size.x, low_m, high_m])
        elif marker.type == Marker.CUBE:
            yaw_rad = 2.0 * math.atan2(marker.pose.orientation.z, marker.pose.orientation.w)
            half = (0.5 * size.x, 0.5 * size.y)
            found["boxes"].append([place.x, place.y, *half, yaw_rad, low_m, high_m])
        elif marker.type == Marker.CUBE_LIST:
            for spot in marker.points:
                row = [spot.x, spot.y, 0.5 * size.x, spot.z - 0.5 * size.z, spot.z + 0.5 * size.z]
                found["seen"].append(row)
    return found
