"""The only conversions between axes, and between each firmware's flat local frame and the earth.

Plain floats and tuples of them, no state; lengths in metres. Frames, as REP-103 and MAVLink define
them:

- NED: x north, y east, z down. Yaw 0 is north, positive clockwise seen from above.
- ENU: x east, y north, z up. Yaw 0 is east, positive counter-clockwise seen from above.
- FRD: body, x forward, y right, z down.   FLU: body, x forward, y left, z up.

Angles are in radians, latitudes and longitudes in degrees. Quaternions are (w, x, y, z) and turn
body vectors into the world frame they are named after.

An autopilot flies in metres north and east of a local origin, and turns every latitude and
longitude into such metres by a projection of its own. None of them is exact: against the WGS-84
ellipsoid they are off by up to 0.7 % of the distance (docs/frames_and_units.md). To make a vehicle
stand at a position that is given, one must measure as the vehicle does, so the profiles name the
projection of their firmware.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

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


def quaternion_inverse(quaternion: Quaternion) -> Quaternion:
    """Return the turn back of a unit quaternion."""
    w, x, y, z = quaternion
    return (w, -x, -y, -z)


def quaternion_turn(quaternion: Quaternion, vector: Vector3) -> Vector3:
    """Return a vector turned by a unit quaternion."""
    half = quaternion_multiply(quaternion, (0.0, *vector))
    _, x, y, z = quaternion_multiply(half, quaternion_inverse(quaternion))
    return (x, y, z)


def yaw_of_quaternion(quaternion: Quaternion) -> float:
    """Return the yaw of a turn, about the third axis, in radians from -pi to pi."""
    w, x, y, z = quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


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


Geodetic = tuple[float, float, float]
"""Latitude and longitude in degrees, altitude above mean sea level in metres."""

# Location.cpp, longitude_scale: the least that a degree of longitude shrinks to at the poles.
_LEAST_SCALE = 0.01
_WGS84_A_M = 6378137.0
_WGS84_E2 = 0.0066943799901413165
# Finding the origin from a place contracts by the distance over the earth's radius, times the
# tangent of the latitude: by 100 or more, up to 85 degrees and 5 km.
_ROUNDS = 6


class Projection(Protocol):
    """Turns places into metres from an origin, and back."""

    def to_local(
        self, latitude_deg: float, longitude_deg: float, origin: Geodetic
    ) -> tuple[float, float]:
        """Return how far north and east of the origin a place is, in metres."""

    def to_geodetic(self, north_m: float, east_m: float, origin: Geodetic) -> tuple[float, float]:
        """Return latitude and longitude of a point north and east of the origin."""


@dataclass(frozen=True)
class MeanLatitude:
    """A degree of latitude has one length; one of longitude shrinks by the mean latitude's cosine.

    ArduPilot, from 4.2 on: Location.cpp, get_distance_NE and offset_latlng; earlier versions took
    the cosine of one end's latitude. Along a parallel, east stays east, however far.

    Attributes:
        metres_per_degree: of latitude.
    """

    metres_per_degree: float

    def to_local(
        self, latitude_deg: float, longitude_deg: float, origin: Geodetic
    ) -> tuple[float, float]:
        """See `Projection`."""
        turn_deg = math.remainder(longitude_deg - origin[1], 360.0)
        east_m = turn_deg * self.metres_per_degree * _shrinking(0.5 * (latitude_deg + origin[0]))
        return (latitude_deg - origin[0]) * self.metres_per_degree, east_m

    def to_geodetic(self, north_m: float, east_m: float, origin: Geodetic) -> tuple[float, float]:
        """See `Projection`."""
        latitude_deg = origin[0] + north_m / self.metres_per_degree
        scale = _shrinking(0.5 * (latitude_deg + origin[0]))
        turn_deg = east_m / (self.metres_per_degree * scale)
        return latitude_deg, math.remainder(origin[1] + turn_deg, 360.0)


@dataclass(frozen=True)
class AzimuthalEquidistant:
    """Distances and directions from the origin are those on a sphere.

    PX4: lib/geo, MapProjection. Formulas as in Snyder, "Map Projections: A Working Manual"
    (USGS 1395), chapter 25. With two radii the lengths north and east are stretched apart: with
    the ellipsoid's radii of curvature at the origin it is right to centimetres at 5 km.

    Attributes:
        radius_north_m: of the sphere, for lengths north.
        radius_east_m: the same for lengths east.
    """

    radius_north_m: float
    radius_east_m: float

    def to_local(
        self, latitude_deg: float, longitude_deg: float, origin: Geodetic
    ) -> tuple[float, float]:
        """See `Projection`."""
        latitude, start = math.radians(latitude_deg), math.radians(origin[0])
        turn = math.radians(longitude_deg - origin[1])
        sine, cosine = math.sin(latitude), math.cos(latitude)
        sine_0, cosine_0 = math.sin(start), math.cos(start)
        north = cosine_0 * sine - sine_0 * cosine * math.cos(turn)
        east = cosine * math.sin(turn)
        sine_away = math.hypot(north, east)
        cosine_away = sine_0 * sine + cosine_0 * cosine * math.cos(turn)
        longer = math.atan2(sine_away, cosine_away) / sine_away if sine_away > 0.0 else 1.0
        return north * longer * self.radius_north_m, east * longer * self.radius_east_m

    def to_geodetic(self, north_m: float, east_m: float, origin: Geodetic) -> tuple[float, float]:
        """See `Projection`."""
        north, east = north_m / self.radius_north_m, east_m / self.radius_east_m
        away = math.hypot(north, east)
        shorter = math.sin(away) / away if away > 0.0 else 1.0
        start = math.radians(origin[0])
        sine_0, cosine_0 = math.sin(start), math.cos(start)
        north, east, up = north * shorter, east * shorter, math.cos(away)
        outward = up * cosine_0 - north * sine_0
        latitude = math.atan2(up * sine_0 + north * cosine_0, math.hypot(outward, east))
        turn_deg = math.degrees(math.atan2(east, outward))
        return math.degrees(latitude), math.remainder(origin[1] + turn_deg, 360.0)


def equidistant_at(latitude_deg: float) -> AzimuthalEquidistant:
    """Return the projection whose metres near a latitude are those of the WGS-84 ellipsoid."""
    w2 = 1.0 - _WGS84_E2 * math.sin(math.radians(latitude_deg)) ** 2
    across_m = _WGS84_A_M / math.sqrt(w2)
    return AzimuthalEquidistant(across_m * (1.0 - _WGS84_E2) / w2, across_m)


@dataclass(frozen=True)
class LocalFrame:
    """A vehicle's local frame: north, east and down in its own metres from an origin.

    Heights are differences of altitudes, as in LOCAL_POSITION_NED: no firmware counts the
    curvature of the earth in (8 cm at 1 km).

    Attributes:
        origin: where it begins.
        projection: how it lies over the earth.
    """

    origin: Geodetic
    projection: Projection

    @staticmethod
    def through(place: Geodetic, position_ned_m: Vector3, projection: Projection) -> LocalFrame:
        """Return the frame in which a place has a position."""
        north_m, east_m, down_m = position_ned_m
        altitude_m = place[2] + down_m
        origin = (*projection.to_geodetic(-north_m, -east_m, place), altitude_m)
        for _ in range(_ROUNDS):
            # Back is not the opposite direction: on a sphere north turns on the way.
            found_north_m, found_east_m = projection.to_local(place[0], place[1], origin)
            back = projection.to_geodetic(found_north_m - north_m, found_east_m - east_m, origin)
            origin = (*back, altitude_m)
        return LocalFrame(origin, projection)

    def ned_m(self, place: Geodetic) -> Vector3:
        """Return a place in the frame."""
        north_m, east_m = self.projection.to_local(place[0], place[1], self.origin)
        return north_m, east_m, self.origin[2] - place[2]

    def enu_m(self, place: Geodetic) -> Vector3:
        """Return a place in the axes of ROS: east, north, up."""
        return ned_to_enu(self.ned_m(place))

    def geodetic(self, position_ned_m: Vector3) -> Geodetic:
        """Return the place of a position in the frame."""
        north_m, east_m, down_m = position_ned_m
        latitude_deg, longitude_deg = self.projection.to_geodetic(north_m, east_m, self.origin)
        return latitude_deg, longitude_deg, self.origin[2] - down_m


def _shrinking(latitude_deg: float) -> float:
    return max(math.cos(math.radians(latitude_deg)), _LEAST_SCALE)
