"""Degrees to metres near a point, the way the firmware does it.

A sphere tangent at the origin: 1e-7 degrees of latitude are 0.0111318845 m, and longitude
shrinks with the cosine of the latitude. The recordings show the same factor (HOME_POSITION
one unit south of the origin has x = -0.011131884). Good to a centimetre within a kilometre.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

METRES_PER_DEGREE = 111318.84502145034


class GeoPoint(NamedTuple):
    """A place on earth. Altitude above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


@lru_cache(maxsize=256)
def _shrinking(latitude_deg: float) -> float:
    """Of longitude with latitude; kept, since all origins are asked for again and again."""
    return max(math.cos(math.radians(latitude_deg)), 0.01)


def to_geodetic(origin: GeoPoint, north_m: float, east_m: float, down_m: float) -> GeoPoint:
    """The place of a NED offset (metres) from an origin."""
    latitude = origin.latitude_deg + north_m / METRES_PER_DEGREE
    scale = _shrinking(origin.latitude_deg)
    longitude = origin.longitude_deg + east_m / (METRES_PER_DEGREE * scale)
    longitude = math.remainder(longitude, 360.0)
    return GeoPoint(latitude, longitude, origin.altitude_amsl_m - down_m)


def to_local(origin: GeoPoint, point: GeoPoint) -> tuple[float, float, float]:
    """The NED offset (metres) of a place from an origin."""
    scale = _shrinking(origin.latitude_deg)
    turn = math.remainder(point.longitude_deg - origin.longitude_deg, 360.0)
    return (
        (point.latitude_deg - origin.latitude_deg) * METRES_PER_DEGREE,
        turn * METRES_PER_DEGREE * scale,
        origin.altitude_amsl_m - point.altitude_amsl_m,
    )
