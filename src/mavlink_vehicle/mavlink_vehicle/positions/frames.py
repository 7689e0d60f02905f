"""The only conversions between axes. Plain tuples of floats; angles in radians.

Frames, as REP-103 and MAVLink define them:

- NED: x north, y east, z down. Yaw 0 is north, positive clockwise seen from above.
- ENU: x east, y north, z up. Yaw 0 is east, positive counter-clockwise seen from above.
- FRD: body, x forward, y right, z down.   FLU: body, x forward, y left, z up.

Places on earth are turned into NED and back by `projections`.

Quaternions are (w, x, y, z) and turn body vectors into the world frame they are named after.
"""

from __future__ import annotations

import math

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

_SQRT_HALF = math.sqrt(0.5)


def normalize_angle(angle_rad: float) -> float:
    """Return the same direction in (-pi, pi]. NaN stays NaN."""
    if -math.pi < angle_rad <= math.pi:
        return angle_rad
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


def quaternion_ned_frd_to_enu_flu(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude FRD -> NED (MAVLink) into FLU -> ENU (REP-103).

    The turn between the world frames swaps x and y and flips z: half a turn about the diagonal
    (x + y), (0, s, s, 0) with s the root of 1/2. Between the body frames it is half a turn about x,
    (0, 1, 0, 0). This is the product of the first, the attitude and the second.
    """
    w, x, y, z = (_SQRT_HALF * part for part in quaternion)
    return (-(w + z), -(x + y), y - x, z - w)


def attitude_enu_flu(roll_rad: float, pitch_rad: float, yaw_ned_rad: float) -> Quaternion:
    """Return an attitude of MAVLink as the quaternion of REP-103 whose w is not negative."""
    attitude = quaternion_ned_frd_to_enu_flu(
        quaternion_from_euler(roll_rad, pitch_rad, yaw_ned_rad)
    )
    w, x, y, z = attitude
    return (-w, -x, -y, -z) if w < 0.0 else attitude


def quaternion_enu_flu_to_ned_frd(quaternion: Quaternion) -> Quaternion:
    """Turn an attitude FLU -> ENU (REP-103) into FRD -> NED (MAVLink); both are half turns."""
    return quaternion_ned_frd_to_enu_flu(quaternion)
