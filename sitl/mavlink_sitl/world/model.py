"""The records that make up a world, in metres from the world's origin.

North and East are horizontal; heights and altitudes point up. The origin is a place on
earth, or the home of the first vehicle when the world does not say.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

from mavlink_sitl.geodesy import GeoPoint

Place = tuple[float, float]
"""North and East, metres"""


@dataclass(frozen=True)
class MoverPath:
    """A path that an obstacle follows at a steady speed, forever.

    Attributes:
        points_m: corners, North and East.
        speed_m_s: above 0.
        back_and_forth: turn round at the end; else continue from the last point to the first.
    """

    points_m: tuple[Place, ...]
    speed_m_s: float
    back_and_forth: bool = True

    def at(self, time_s: float) -> Place:
        """Its position after a time in seconds."""
        corners = list(self.points_m)
        corners += corners[-2:0:-1] + corners[:1] if self.back_and_forth else corners[:1]
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(corners)]
        left = math.fmod(time_s * self.speed_m_s, math.fsum(lengths))
        for length, (a, b) in zip(lengths, itertools.pairwise(corners), strict=True):
            if left <= length and length > 0.0:
                part = left / length
                return a[0] + (b[0] - a[0]) * part, a[1] + (b[1] - a[1]) * part
            left -= length
        return corners[-1]


@dataclass(frozen=True)
class Obstacle:
    """A thing with a level top and upright sides.

    Attributes:
        at_m: its middle; of a moving one, at the start.
        radius_m: of a cylinder; 0 for a box.
        size_m: North and East before turning, of a box.
        yaw_rad: how a box is turned, clockwise from North.
        bottom_m: height of its lower side above the origin.
        top_m: height of its upper side above the origin.
        path: where it goes, if it moves.
    """

    name: str
    at_m: Place
    radius_m: float = 0.0
    size_m: Place = (0.0, 0.0)
    yaw_rad: float = 0.0
    bottom_m: float = 0.0
    top_m: float = 10.0
    path: MoverPath | None = None


@dataclass(frozen=True)
class Wind:
    """Steady wind and its gusts.

    Attributes:
        velocity_ned_m_s: of the air.
        gust_m_s: standard deviation of what comes on top, on each axis.
        gust_time_s: how long a gust lasts (its correlation time).
    """

    velocity_ned_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust_m_s: float = 0.0
    gust_time_s: float = 2.0


def wind_from(
    speed_m_s: float, from_deg: float, up_m_s: float = 0.0, gust_m_s: float = 0.0
) -> Wind:
    """A wind by its speed and the direction that it comes from, clockwise from North."""
    angle = math.radians(from_deg)
    velocity = (-speed_m_s * math.cos(angle), -speed_m_s * math.sin(angle), -up_m_s)
    return Wind(velocity, gust_m_s)


@dataclass(frozen=True)
class Ground:
    """Height of the ground above the origin.

    Attributes:
        height_m: where no grid is.
        corner_m: the south-west corner of the grid.
        spacing_m: between points of the grid, in both directions.
        heights_m: rows from South to North, in each from West to East; empty for flat ground.
            In between it is bilinear; beyond the edge it continues level.
    """

    height_m: float = 0.0
    corner_m: Place = (0.0, 0.0)
    spacing_m: float = 10.0
    heights_m: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class GpsQuality:
    """The quality of the GPS receivers in this world.

    Attributes:
        noise_m: standard deviation of the position on each axis.
        dropouts_per_hour: how often the fix is lost, on average.
        dropout_s: for how long.
    """

    noise_m: float = 0.015
    dropouts_per_hour: float = 0.0
    dropout_s: float = 5.0


@dataclass(frozen=True)
class RangeSensor:
    """A scanner around the vehicle, and a beam downwards.

    Attributes:
        reach_m: the farthest it sees, around.
        reach_down_m: the same, downwards.
        noise_m: standard deviation of a reading.
    """

    reach_m: float = 40.0
    reach_down_m: float = 50.0
    noise_m: float = 0.02


@dataclass(frozen=True)
class Mark:
    """A mark on the ground, for landings.

    Attributes:
        at_m: its middle.
        height_m: above the origin.
    """

    at_m: Place
    height_m: float = 0.0


@dataclass(frozen=True)
class MarkCamera:
    """The camera with which each vehicle looks for the mark: fixed to it, straight down.

    Attributes:
        rate_hz: pictures per second.
        half_view_deg: greatest angle of the mark from the camera's axis.
        noise: standard deviation of the measured position on each axis, as a share of its distance.
        loss: share of the pictures in which the mark is not found.
        delay_s: from the picture to its result.
    """

    rate_hz: float = 10.0
    half_view_deg: float = 45.0
    noise: float = 0.01
    loss: float = 0.1
    delay_s: float = 0.1


@dataclass(frozen=True)
class World:
    """Everything around the vehicles. The empty one is a plain in still air."""

    name: str = "plain"
    origin: GeoPoint | None = None
    ground: Ground = Ground()
    wind: Wind = Wind()
    obstacles: tuple[Obstacle, ...] = ()
    gps: GpsQuality = GpsQuality()
    range_sensor: RangeSensor | None = None
    mark: Mark | None = None
    camera: MarkCamera = MarkCamera()
