"""Degrees to metres around a point, with the projection of each firmware.

Each firmware lays its local frame over the earth by a projection of its own:

- ArduPilot (Location.cpp): 1e-7 degrees of latitude are 0.0111318845 m, and longitude shrinks
  with the cosine of the latitude half way. The recordings show the same factor (HOME_POSITION
  one unit south of the origin has x = -0.011131884; `plane_guided` over 400 m).
- PX4 (lib/geo, MapProjection): an azimuthal equidistant projection of a sphere of 6371 km; the
  recordings show its 111 195 m a degree (`mission_clear`, `offboard_loss_stop`).

Bodies move in the metres of their firmware's frame, as in ArduPilot's own simulator. PX4's own
moves them on the ellipsoid, so that its speeds differ by up to half a percent.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple, Protocol

METRES_PER_DEGREE = 111318.84502145034
"""ArduPilot's: AP_Math, LATLON_TO_M times 1e7"""
EARTH_RADIUS_M = 6371000.0
"""PX4's: lib/geo, CONSTANTS_RADIUS_OF_EARTH"""


class GeoPoint(NamedTuple):
    """A place on earth. Altitude above mean sea level."""

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


class Projection(Protocol):
    """Turns latitude and longitude into metres North and East of an origin, and back."""

    def to_local(self, origin: GeoPoint, point: GeoPoint) -> tuple[float, float]:
        """A position in metres north and east of the origin."""
        ...

    def to_geodetic(self, origin: GeoPoint, north_m: float, east_m: float) -> tuple[float, float]:
        """Latitude and longitude, degrees, of a place so far North and East."""
        ...


@lru_cache(maxsize=256)
def _shrinking(latitude_deg: float) -> float:
    """Of longitude with latitude."""
    return max(math.cos(math.radians(latitude_deg)), 0.01)


class ArduPilotProjection:
    """A cylinder; its scale along the parallels is that of the latitude half way."""

    def to_local(self, origin: GeoPoint, point: GeoPoint) -> tuple[float, float]:
        """See `Projection`."""
        turn_deg = math.remainder(point.longitude_deg - origin.longitude_deg, 360.0)
        scale = _shrinking((point.latitude_deg + origin.latitude_deg) / 2.0)
        north_m = (point.latitude_deg - origin.latitude_deg) * METRES_PER_DEGREE
        return north_m, turn_deg * METRES_PER_DEGREE * scale

    def to_geodetic(self, origin: GeoPoint, north_m: float, east_m: float) -> tuple[float, float]:
        """See `Projection`."""
        up_deg = north_m / METRES_PER_DEGREE
        scale = _shrinking(origin.latitude_deg + up_deg / 2.0)
        longitude_deg = origin.longitude_deg + east_m / (METRES_PER_DEGREE * scale)
        return origin.latitude_deg + up_deg, math.remainder(longitude_deg, 360.0)


class Px4Projection:
    """Azimuthal equidistant on a sphere (mathworld.wolfram.com, of that name)."""

    def to_local(self, origin: GeoPoint, point: GeoPoint) -> tuple[float, float]:
        """See `Projection`."""
        lat, lat_0 = math.radians(point.latitude_deg), math.radians(origin.latitude_deg)
        turn = math.radians(point.longitude_deg - origin.longitude_deg)
        cosine = math.sin(lat_0) * math.sin(lat) + math.cos(lat_0) * math.cos(lat) * math.cos(turn)
        away = math.acos(min(max(cosine, -1.0), 1.0))
        reach_m = EARTH_RADIUS_M * (away / math.sin(away) if away else 1.0)
        north = math.cos(lat_0) * math.sin(lat) - math.sin(lat_0) * math.cos(lat) * math.cos(turn)
        return reach_m * north, reach_m * math.cos(lat) * math.sin(turn)

    def to_geodetic(self, origin: GeoPoint, north_m: float, east_m: float) -> tuple[float, float]:
        """See `Projection`."""
        lat_0 = math.radians(origin.latitude_deg)
        away = math.hypot(north_m, east_m) / EARTH_RADIUS_M
        if not away:
            return origin.latitude_deg, origin.longitude_deg
        course = math.atan2(east_m, north_m)
        sine = math.cos(away) * math.sin(lat_0) + math.sin(away) * math.cos(lat_0) * math.cos(
            course
        )
        turn = math.atan2(
            math.sin(course) * math.sin(away),
            math.cos(lat_0) * math.cos(away) - math.sin(lat_0) * math.sin(away) * math.cos(course),
        )
        latitude_deg = math.degrees(math.asin(min(max(sine, -1.0), 1.0)))
        return latitude_deg, math.remainder(origin.longitude_deg + math.degrees(turn), 360.0)


ARDUPILOT: Projection = ArduPilotProjection()
PX4: Projection = Px4Projection()


class LocalFrame(NamedTuple):
    """NED metres about an origin, as a firmware counts them."""

    origin: GeoPoint
    projection: Projection

    def to_geodetic(self, north_m: float, east_m: float, down_m: float) -> GeoPoint:
        """The place of a position."""
        place = self.projection.to_geodetic(self.origin, north_m, east_m)
        return GeoPoint(*place, self.origin.altitude_amsl_m - down_m)

    def to_local(self, point: GeoPoint) -> tuple[float, float, float]:
        """The position of a place."""
        north_m, east_m = self.projection.to_local(self.origin, point)
        return north_m, east_m, self.origin.altitude_amsl_m - point.altitude_amsl_m
