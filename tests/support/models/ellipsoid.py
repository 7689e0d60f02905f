"""The WGS-84 ellipsoid, exactly, by earth-centred coordinates: what projections are held against.

No firmware measures by it, and so the project does not either.
"""

from __future__ import annotations

import math

from mavlink_vehicle.positions.frames import Geodetic, Vector3

A_M = 6378137.0
F = 1.0 / 298.257223563
E2 = F * (2.0 - F)


def to_ned(place: Geodetic, origin: Geodetic) -> Vector3:
    """Return a place in the tangent plane at an origin: north, east, down in metres."""
    dx, dy, dz = (a - b for a, b in zip(_to_ecef(place), _to_ecef(origin), strict=True))
    sin_lat, cos_lat, sin_lon, cos_lon = _turns(origin)
    outward = cos_lon * dx + sin_lon * dy
    return (
        -sin_lat * outward + cos_lat * dz,
        -sin_lon * dx + cos_lon * dy,
        -cos_lat * outward - sin_lat * dz,
    )


def on_ground(north_m: float, east_m: float, origin: Geodetic) -> Geodetic:
    """Return the place, as high as the origin, that is so far north and east of it."""
    sin_lat, cos_lat, sin_lon, cos_lon = _turns(origin)
    ox, oy, oz = _to_ecef(origin)
    down_m = 0.0
    place = origin
    for _ in range(6):  # down to the surface, as the tangent plane rises above it
        outward = -sin_lat * north_m - cos_lat * down_m
        place = _to_geodetic(
            ox + cos_lon * outward - sin_lon * east_m,
            oy + sin_lon * outward + cos_lon * east_m,
            oz + cos_lat * north_m - sin_lat * down_m,
        )
        down_m += place[2] - origin[2]
    return (place[0], place[1], origin[2])


def _turns(origin: Geodetic) -> tuple[float, float, float, float]:
    latitude, longitude = math.radians(origin[0]), math.radians(origin[1])
    return math.sin(latitude), math.cos(latitude), math.sin(longitude), math.cos(longitude)


def _to_ecef(place: Geodetic) -> Vector3:
    sin_lat, cos_lat, sin_lon, cos_lon = _turns(place)
    normal = A_M / math.sqrt(1.0 - E2 * sin_lat * sin_lat)
    radius = (normal + place[2]) * cos_lat
    return radius * cos_lon, radius * sin_lon, (normal * (1.0 - E2) + place[2]) * sin_lat


def _to_geodetic(x: float, y: float, z: float) -> Geodetic:
    radius = math.hypot(x, y)
    latitude = math.atan2(z, radius * (1.0 - E2))
    for _ in range(8):
        normal = A_M / math.sqrt(1.0 - E2 * math.sin(latitude) ** 2)
        latitude = math.atan2(z + E2 * normal * math.sin(latitude), radius)
    sin_lat, cos_lat = math.sin(latitude), math.cos(latitude)
    normal = A_M / math.sqrt(1.0 - E2 * sin_lat * sin_lat)
    # Along the normal, which is well conditioned at the poles and at the equator alike.
    altitude_m = radius * cos_lat + z * sin_lat - normal * (1.0 - E2 * sin_lat * sin_lat)
    return math.degrees(latitude), math.degrees(math.atan2(y, x)), altitude_m
