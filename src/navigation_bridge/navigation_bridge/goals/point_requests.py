"""Goals to a single position, checked and resolved into the map frame. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from mavlink_vehicle.positions import frames
from navigation_bridge.goals.requests import NavigateRequest
from navigation_bridge.names import FRAME_BASE_LINK, FRAME_MAP, FRAME_WGS84
from navigation_bridge.vehicle.map_frame import MapPose
from navigation_core.geometry import Vector3, add
from navigation_core.outcomes import OutcomeCode
from navigation_core.safety.target_checks import FlightVolume, Rejection, check_target
from navigation_core.tasks.flying.goto import GotoGoal
from navigation_core.tasks.traits import COPTER, Traits

# A norm this close to 1 is explained by rounding (float32, YAML typed by hand); any other is not an
# orientation.
_NORM_TOLERANCE = 0.1
_ZERO_QUATERNION = 1e-6
# A slower flight would be lost in the noise of any position estimate.
SPEED_MIN_M_S = 0.05
_POSITION_FIELDS = tuple(f"target_pose.pose.position.{axis}" for axis in "xyz")
_ORIENTATION_FIELDS = tuple(f"target_pose.pose.orientation.{axis}" for axis in "xyzw")


def check_request(request: NavigateRequest) -> Rejection | None:
    """Check a request without a vehicle: numbers, frame, speed, orientation."""
    numbers = {
        **dict(zip(_POSITION_FIELDS, request.position, strict=True)),
        **dict(zip(_ORIENTATION_FIELDS, request.orientation_xyzw, strict=True)),
        "max_speed": request.max_speed_m_s,
    }
    bad = [f"{name} is {number}" for name, number in numbers.items() if not math.isfinite(number)]
    if bad:
        return Rejection(
            OutcomeCode.INVALID_NUMBER, f"{', '.join(bad)}; every number must be finite."
        )
    rejection = check_frame(request.frame_id, request.position)
    rejection = rejection or check_speed(request.max_speed_m_s)
    if rejection is not None:
        return rejection
    norm = math.sqrt(math.fsum(part * part for part in request.orientation_xyzw))
    if norm > _ZERO_QUATERNION and abs(norm - 1.0) > _NORM_TOLERANCE:
        return Rejection(
            OutcomeCode.INVALID_ORIENTATION,
            f"The orientation's norm is {norm:.3f}; send a unit quaternion, or all zeros to face "
            "the direction of travel.",
        )
    if norm > _ZERO_QUATERNION and yaw_enu_rad(request.orientation_xyzw) is None:
        return Rejection(
            OutcomeCode.INVALID_ORIENTATION,
            "The orientation points straight up or down and has no yaw; send a rotation "
            "about z, or all zeros to face the direction of travel.",
        )
    return None


def check_frame(frame_id: str, position: Vector3) -> Rejection | None:
    """Return why a finite position in a frame is not one, or None."""
    if frame_id not in ("", FRAME_MAP, FRAME_BASE_LINK, FRAME_WGS84):
        return Rejection(
            OutcomeCode.UNKNOWN_FRAME,
            f"Unknown frame '{frame_id}'; use '{FRAME_MAP}' (ENU metres from the "
            f"vehicle's local origin), '{FRAME_BASE_LINK}' (FLU metres from the vehicle) or "
            f"'{FRAME_WGS84}' (latitude, longitude, altitude above mean sea level).",
        )
    return check_geodetic(position) if frame_id == FRAME_WGS84 else None


def position_in_map(
    frame_id: str,
    position: Vector3,
    pose: MapPose,
    geodetic_to_enu: Callable[[Vector3], Vector3],
) -> Vector3:
    """Return a position of a frame that passed :func:`check_frame` in the map frame.

    Args:
        frame_id: its frame.
        position: in that frame.
        pose: the vehicle's present pose; a base_link position is relative to its position and yaw
            (the level body frame: roll and pitch do not tilt it).
        geodetic_to_enu: converts (latitude, longitude, altitude AMSL) into the map frame.
    """
    if frame_id == FRAME_WGS84:
        return geodetic_to_enu(position)
    if frame_id == FRAME_BASE_LINK:
        return add(pose.position_enu_m, frames.body_flu_to_enu(position, pose.yaw_enu_rad))
    return position


def check_speed(max_speed_m_s: float) -> Rejection | None:
    """Return why a goal cannot have this highest speed, or None."""
    if not math.isfinite(max_speed_m_s):
        return Rejection(
            OutcomeCode.INVALID_NUMBER, f"max_speed is {max_speed_m_s}; it must be finite."
        )
    if max_speed_m_s < 0.0:
        return Rejection(
            OutcomeCode.NEGATIVE_SPEED,
            f"max_speed is {max_speed_m_s:g} m/s; it must be positive, or 0 for the "
            "configured default.",
        )
    if 0.0 < max_speed_m_s < SPEED_MIN_M_S:
        return Rejection(
            OutcomeCode.INVALID_NUMBER,
            f"max_speed is {max_speed_m_s:g} m/s; the minimum is {SPEED_MIN_M_S:g} m/s.",
        )
    return None


def check_geodetic(position: Vector3) -> Rejection | None:
    """Return why latitude and longitude (degrees) are not a position on earth, or None."""
    latitude_deg, longitude_deg, _ = position
    if abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0:
        return None
    return Rejection(
        OutcomeCode.INVALID_NUMBER,
        f"({latitude_deg:g}, {longitude_deg:g}) is not a position on earth; give latitude (-90 to "
        "90 degrees) first, then longitude (-180 to 180 degrees).",
    )


# A target this close to the ground counts as on it.
GROUND_TOLERANCE_M = 2.0


def on_ground(position_enu_m: Vector3, ground_enu_m: float, traits: Traits) -> Vector3 | Rejection:
    """Return the target of a rover or boat, on the ground; reject one in the air.

    Targets of vehicles that fly are returned as they are.
    """
    if traits.flies:
        return position_enu_m
    height_m = position_enu_m[2] - ground_enu_m
    if abs(height_m) > GROUND_TOLERANCE_M:
        return Rejection(
            OutcomeCode.UNSUPPORTED_VEHICLE,
            f"A {traits.name} cannot climb: the target is {height_m:.1f} m above the ground; give "
            f"the altitude of the ground, within {GROUND_TOLERANCE_M:g} m.",
        )
    return (position_enu_m[0], position_enu_m[1], ground_enu_m)


def volume_for(volume: FlightVolume, traits: Traits) -> FlightVolume:
    """Return the volume for a kind of vehicle; rovers and boats are always at height 0."""
    if traits.flies:
        return volume
    return replace(volume, altitude_min_m=-GROUND_TOLERANCE_M)


def resolve(
    request: NavigateRequest,
    pose: MapPose,
    geodetic_to_enu: Callable[[Vector3], Vector3],
    ground_enu_m: float,
    volume: FlightVolume,
    speed_max_m_s: float,
    traits: Traits = COPTER,
) -> GotoGoal | Rejection:
    """Turn a request that passed :func:`check_request` into a target in the map frame.

    Args:
        request: the client's request.
        pose: the vehicle's present pose, as for :func:`position_in_map`.
        geodetic_to_enu: converts (latitude, longitude, altitude AMSL) into the map frame.
        ground_enu_m: height of the ground in the map frame.
        volume: where targets are accepted.
        speed_max_m_s: configured maximum ground speed.
        traits: capabilities of the vehicle.

    Returns:
        The goal, or the reason for its rejection.
    """
    yaw = yaw_enu_rad(request.orientation_xyzw)
    position = position_in_map(request.frame_id, request.position, pose, geodetic_to_enu)
    if request.frame_id == FRAME_BASE_LINK and yaw is not None:
        yaw = frames.normalize_angle(pose.yaw_enu_rad + yaw)
    speed = None
    if request.max_speed_m_s > 0.0:
        speed = min(request.max_speed_m_s, speed_max_m_s)
    placed = on_ground(position, ground_enu_m, traits)
    if isinstance(placed, Rejection):
        return placed
    position = placed
    rejection = check_target(position, speed, ground_enu_m, volume_for(volume, traits))
    if rejection is not None:
        return rejection
    return GotoGoal(position_enu_m=position, yaw_enu_rad=yaw, max_speed_m_s=speed)


def yaw_enu_rad(orientation_xyzw: tuple[float, float, float, float]) -> float | None:
    """Return the yaw of a quaternion; None if it is all zero or has no heading."""
    x, y, z, w = orientation_xyzw
    # Direction of the body's x axis in the horizontal plane, unnormalised.
    east = w * w + x * x - y * y - z * z
    north = 2.0 * (x * y + w * z)
    if math.hypot(east, north) < 1e-3:
        return None
    return math.atan2(north, east)
