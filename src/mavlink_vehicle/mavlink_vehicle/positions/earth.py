"""The earth-centred, earth-fixed frame: metres on the WGS 84 ellipsoid.

REP 105 calls it `earth`: x to the equator at Greenwich, z to the north pole.
"""

from __future__ import annotations

import math

from mavlink_vehicle.positions.frames import Quaternion, Vector3, quaternion_multiply

__all__ = ["earth_position_m", "enu_in_earth"]

# The defining constants of WGS 84 (NIMA TR8350.2).
_A_M = 6378137.0
_FLATTENING = 1.0 / 298.257223563
_E2 = _FLATTENING * (2.0 - _FLATTENING)


def earth_position_m(
    latitude_deg: float, longitude_deg: float, altitude_ellipsoid_m: float
) -> Vector3:
    """Return a place in the earth frame; its altitude is above the ellipsoid."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    normal_m = _A_M / math.sqrt(1.0 - _E2 * math.sin(latitude) ** 2)
    outward_m = (normal_m + altitude_ellipsoid_m) * math.cos(latitude)
    return (
        outward_m * math.cos(longitude),
        outward_m * math.sin(longitude),
        (normal_m * (1.0 - _E2) + altitude_ellipsoid_m) * math.sin(latitude),
    )


def enu_in_earth(latitude_deg: float, longitude_deg: float) -> Quaternion:
    """Return the rotation from east, north, up at a place into the earth frame."""
    about_z = math.radians(longitude_deg + 90.0) / 2.0
    about_east = math.radians(90.0 - latitude_deg) / 2.0
    return quaternion_multiply(
        (math.cos(about_z), 0.0, 0.0, math.sin(about_z)),
        (math.cos(about_east), math.sin(about_east), 0.0, 0.0),
    )
