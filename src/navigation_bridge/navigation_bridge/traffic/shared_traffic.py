"""The reservations that the vehicles of one server share. No ROS."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mavlink_vehicle.positions.frames import Geodetic
from navigation_bridge.traffic.other_traffic import OtherTraffic, Seen
from navigation_bridge.traffic.own_echo import OwnTrack
from navigation_bridge.vehicle.map_frame import MapFrame
from navigation_core.tasks.traffic.negotiation import Negotiation
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.traffic_view import TrafficFrame
from navigation_core.tasks.traffic.volumes import Array, Separation, Volume

__all__ = ["EarthFrame", "SharedTraffic"]

# Mean length of a degree of latitude. Only differences between vehicles that are near each other
# count, so that the projection may be as simple as this.
_METRES_PER_DEGREE = 111_200.0
# Length of the lines by which the axes of a map are found.
_AXIS_M = 100.0
_UPDATE_PERIOD_S = 0.2
# Period in which each vehicle updates what it holds, and while there is nobody to keep apart from.
_PERIOD_S, _ALONE_PERIOD_S = 0.2, 1.0


@dataclass(frozen=True)
class EarthFrame:
    """The traffic frame: metres east and north of a place, and altitude above mean sea level.

    Attributes:
        latitude_deg: of that place.
        longitude_deg: the same.
    """

    latitude_deg: float
    longitude_deg: float

    def metres(self, place: Geodetic) -> tuple[float, float, float]:
        """Return a place in the frame."""
        turn_deg = math.remainder(place[1] - self.longitude_deg, 360.0)
        east_m = turn_deg * _METRES_PER_DEGREE * self._shrinking
        return east_m, (place[0] - self.latitude_deg) * _METRES_PER_DEGREE, place[2]

    def geodetic(self, point_m: Array) -> Geodetic:
        """Return the place of a point of the frame, shape (3,)."""
        turn_deg = float(point_m[0]) / (_METRES_PER_DEGREE * self._shrinking)
        latitude_deg = self.latitude_deg + float(point_m[1]) / _METRES_PER_DEGREE
        longitude_deg = math.remainder(self.longitude_deg + turn_deg, 360.0)
        return latitude_deg, longitude_deg, float(point_m[2])

    @property
    def _shrinking(self) -> float:
        return max(math.cos(math.radians(self.latitude_deg)), 0.01)

    def traffic_frame(self, map_frame: MapFrame) -> TrafficFrame:
        """Return how a map, whose origin is known, lies in the frame."""
        origin = np.array(self.metres(map_frame.geodetic((0.0, 0.0, 0.0))))
        axes = [
            (np.array(self.metres(map_frame.geodetic(end))) - origin) / _AXIS_M
            for end in ((_AXIS_M, 0.0, 0.0), (0.0, _AXIS_M, 0.0), (0.0, 0.0, _AXIS_M))
        ]
        return TrafficFrame(np.stack(axes, axis=1), origin)


class SharedTraffic:
    """The reservations of one server, and the frame that it is in.

    Attributes:
        reservations: the reservations.
        earth: the traffic frame; None until the first vehicle has a position.
        epoch_s: what makes times of one clock of the driver's times, for ranks among servers.
        negotiation: with other servers; None without any.
        others: what else is seen.
        alone_of: for each vehicle returns what it may enter if this server falls silent, and
            where it can ever be sent; None while its position is unknown.
    """

    def __init__(self, separation: Separation | None = None, epoch_s: float = 0.0) -> None:
        """Begin with nobody."""
        self.reservations = TrafficReservations(separation)
        self.earth: EarthFrame | None = None
        self.epoch_s = epoch_s
        self.negotiation: Negotiation | None = None
        self.others = OtherTraffic(self.reservations)
        self.alone_of: dict[str, Callable[[], tuple[Volume, Volume] | None]] = {}
        self._updated_s = -math.inf

    @property
    def is_alone(self) -> bool:
        """Whether nobody else is known of."""
        return len(self.reservations.entries) < 2 and self.reservations.agreement is None

    @property
    def period_s(self) -> float:
        """The time between two looks at what a vehicle holds."""
        return _ALONE_PERIOD_S if self.is_alone and len(self.alone_of) < 2 else _PERIOD_S

    def look(self, now: float) -> None:
        """Update the parts that no step of a task updates: others, and servers that are silent."""
        if now - self._updated_s < _UPDATE_PERIOD_S:
            return
        self._updated_s = now
        self.others.look(now)
        if self.negotiation is not None:
            self.negotiation.look(now)

    def see(self, seen: Seen, now: float, source: str = "") -> None:
        """Take a report of another vehicle; our own ones are known better.

        Args:
            seen: the report.
            now: time in seconds.
            source: which of our vehicles has heard it; empty if none has.
        """
        if self.earth is not None and seen.name not in self.alone_of:
            self.others.take(seen, self.earth.metres(seen.place), now, source)

    def note_own(self, name: str, position_m: Array, velocity_m_s: Array, now: float) -> None:
        """Remember where a vehicle of ours is, in the traffic frame, to know its echo."""
        track = self.others.own.setdefault(name, OwnTrack())
        track.note(position_m, velocity_m_s, now)

    def alone(self) -> dict[str, tuple[Volume, Volume]]:
        """Return for each vehicle what other servers must know in case this one falls silent.

        Nothing while no other server is heard: it hears that there is this one, and answers.
        """
        if self.negotiation is not None and not self.negotiation.peers:
            return {}
        found = {name: of() for name, of in self.alone_of.items()}
        return {name: volumes for name, volumes in found.items() if volumes is not None}

    def frame_about(self, place: Geodetic) -> EarthFrame:
        """Return the traffic frame, which lies about the first place that is asked for."""
        if self.earth is None:
            self.earth = EarthFrame(place[0], place[1])
        return self.earth
