"""The only conversions between frames. Plain tuples of floats; angles in radians.

Frames, as REP-103 and MAVLink define them:

- NED: x north, y east, z down. Yaw 0 is north, positive clockwise seen from above.
- ENU: x east, y north, z up. Yaw 0 is east, positive counter-clockwise seen from above.
- FRD: body, x forward, y right, z down.   FLU: body, x forward, y left, z up.
- Geodetic: WGS-84 latitude and longitude in degrees, altitude in metres; the altitude's
  reference (mean sea level, home) is the caller's and the same on both sides.

Quaternions are (w, x, y, z) and turn body vectors into the world frame they are named after.
"""

from __future__ import annotations

import math

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_WGS84_A_M = 6378137.0
_WGS84_F = 1.0 / 298.257223563
_WGS84_E2 = _WGS84_F * (2.0 - _WGS84_F)
_SQRT_HALF = math.sqrt(0.5)


def normalize_angle(angle_rad: float) -> float:
    """Return the same direction in (-pi, pi]. NaN stays NaN."""
    wrapped = math.remainder(angle_rad, math.tau) if math.isfinite(angle_rad) else math.nan
    return math.pi if wrapped == -math.pi else wrapped


def ned_to_enu(vector_ned: Vector3) -> Vector3:
    """Turn a vector from NED to ENU."""
    north, east, down = vector_ned
    return (east, north, -down)


def enu_to_ned(vector_enu: Vector3) -> Vector3:
    """Turn a vector from ENU to NED."""
    east, north, up = vector_enu
    return (north, east, -up)


def frd_to_flu(vector_frd: Vector3) -> Vector3:
    """Turn a body vector from FRD to FLU."""
    forward, right, down = vector_frd
    return (forward, -right, -down)


def flu_to_frd(vector_flu: Vector3) -> Vector3:
    """Turn a body vector from FLU to FRD."""
    forward, left, up = vector_flu
    return (forward, -left, -up)


def yaw_ned_to_enu(yaw_ned_rad: float) -> float:
    """Turn a heading (0 north, clockwise) into an ENU yaw (0 east, counter-clockwise)."""
    return normalize_angle(math.pi / 2.0 - yaw_ned_rad)


def yaw_enu_to_ned(yaw_enu_rad: float) -> float:
    """Turn an ENU yaw (0 east, counter-clockwise) into a heading (0 north, clockwise)."""
    return normalize_angle(math.pi / 2.0 - yaw_enu_rad)


def body_flu_to_enu(vector_flu: Vector3, yaw_enu_rad: float) -> Vector3:
    """Turn a level body vector (FLU at this ENU yaw) into ENU."""
    forward, left, up = vector_flu
    cosine, sine = math.cos(yaw_enu_rad), math.sin(yaw_enu_rad)
    return (forward * cosine - left * sine, forward * sine + left * cosine, up)


def enu_to_body_flu(vector_enu: Vector3, yaw_enu_rad: float) -> Vector3:
    """Turn an ENU vector into the level body frame (FLU at this ENU yaw)."""
    east, north, up = vector_enu
    cosine, sine = math.cos(yaw_enu_rad), math.sin(yaw_enu_rad)
    return (east * cosine + north * sine, north * cosine - east * sine, up)


def quaternion_from_yaw(yaw_rad: float) -> Quaternion:
    """Return the turn by `yaw_rad` about z."""
    return (math.cos(yaw_rad / 2.0), 0.0, 0.0, math.sin(yaw_rad / 2.0))


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> Quaternion:
    """Return the attitude of intrinsic yaw, pitch, roll (z, y, x: the aerospace order)."""
    cr, sr = math.cos(roll_rad / 2.0), math.sin(roll_rad / 2.0)
    cp, sp = math.cos(pitch_rad / 2.0), math.sin(pitch_rad / 2.0)
    cy, sy = math.cos(yaw_rad / 2.0), math.sin(yaw_rad / 2.0)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def yaw_from_quaternion(quaternion: Quaternion) -> float:
    """Return the yaw about z in (-pi, pi] of a quaternion of any length but zero."""
    w, x, y, z = quaternion
    return normalize_angle(math.atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z))


def quaternion_multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """Return the turn that does `right` first and then `left`."""
    aw, ax, ay, az = left
    bw, bx, by, bz = right
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


# The turn between the world frames swaps x and y and flips z: half a turn about the diagonal
# (x + y); between the body frames it is half a turn about x. Both are their own inverses.
_WORLD_TURN: Quaternion = (0.0, _SQRT_HALF, _SQRT_HALF, 0.0)
_BODY_TURN: Quaternion = (0.0, 1.0, 0.0, 0.0)


def quaternion_ned_frd_to_enu_flu(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude FRD -> NED (MAVLink) into FLU -> ENU (REP-103)."""
    return quaternion_multiply(quaternion_multiply(_WORLD_TURN, quaternion), _BODY_TURN)


def quaternion_enu_flu_to_ned_frd(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude FLU -> ENU (REP-103) into FRD -> NED (MAVLink)."""
    return quaternion_multiply(quaternion_multiply(_WORLD_TURN, quaternion), _BODY_TURN)


def geodetic_to_ned(
    latitude_deg: float,
    longitude_deg: float,
    altitude_m: float,
    origin: tuple[float, float, float],
) -> Vector3:
    """Return where a point lies in the NED frame at `origin`, in metres.

    The exact way by earth-centred coordinates on the WGS-84 ellipsoid, so good to rounding
    (well below a millimetre) at any distance. "Down" is along the ellipsoid's normal at the
    origin; at 10 km the tangent plane is 7.8 m above the curved earth, which this shows.

    Args:
        latitude_deg: latitude of the point.
        longitude_deg: longitude of the point.
        altitude_m: altitude of the point, by the same reference as the origin's.
        origin: (latitude_deg, longitude_deg, altitude_m) of the frame's origin.
    """
    x, y, z = _geodetic_to_ecef(latitude_deg, longitude_deg, altitude_m)
    ox, oy, oz = _geodetic_to_ecef(*origin)
    dx, dy, dz = x - ox, y - oy, z - oz
    latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lon, cos_lon = math.sin(longitude), math.cos(longitude)
    outward = cos_lon * dx + sin_lon * dy
    return (
        -sin_lat * outward + cos_lat * dz,
        -sin_lon * dx + cos_lon * dy,
        -cos_lat * outward - sin_lat * dz,
    )


def ned_to_geodetic(
    position_ned_m: Vector3, origin: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return (latitude_deg, longitude_deg, altitude_m) of a point in the NED frame at `origin`.

    The inverse of `geodetic_to_ned`, with the same accuracy.
    """
    north, east, down = position_ned_m
    latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    sin_lon, cos_lon = math.sin(longitude), math.cos(longitude)
    outward = -sin_lat * north - cos_lat * down
    ox, oy, oz = _geodetic_to_ecef(*origin)
    return _ecef_to_geodetic(
        ox + cos_lon * outward - sin_lon * east,
        oy + sin_lon * outward + cos_lon * east,
        oz + cos_lat * north - sin_lat * down,
    )


def _geodetic_to_ecef(latitude_deg: float, longitude_deg: float, altitude_m: float) -> Vector3:
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    normal = _WGS84_A_M / math.sqrt(1.0 - _WGS84_E2 * sin_lat * sin_lat)
    radius = (normal + altitude_m) * cos_lat
    return (
        radius * math.cos(longitude),
        radius * math.sin(longitude),
        (normal * (1.0 - _WGS84_E2) + altitude_m) * sin_lat,
    )


def _ecef_to_geodetic(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Invert by fixed-point iteration on the latitude; it gains more than two digits a turn."""
    radius = math.hypot(x, y)
    latitude = math.atan2(z, radius * (1.0 - _WGS84_E2))
    for _ in range(8):
        sin_lat = math.sin(latitude)
        normal = _WGS84_A_M / math.sqrt(1.0 - _WGS84_E2 * sin_lat * sin_lat)
        latitude = math.atan2(z + _WGS84_E2 * normal * sin_lat, radius)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    normal = _WGS84_A_M / math.sqrt(1.0 - _WGS84_E2 * sin_lat * sin_lat)
    # Along the normal, which is well conditioned at the poles and at the equator alike.
    altitude = radius * cos_lat + z * sin_lat - normal * (1.0 - _WGS84_E2 * sin_lat * sin_lat)
    return (math.degrees(latitude), math.degrees(math.atan2(y, x)), altitude)
