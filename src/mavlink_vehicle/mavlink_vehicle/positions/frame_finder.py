"""Finds a vehicle's local frame from its telemetry: its origin and its projection.

Where the firmware is known, so is its projection. Where it is not, the lengths of its metres
north and east are measured, by what GLOBAL_POSITION_INT and LOCAL_POSITION_NED say of the same
moment.
"""

from __future__ import annotations

from mavlink_vehicle.positions.frames import (
    AzimuthalEquidistant,
    Geodetic,
    LocalFrame,
    Projection,
    Vector3,
    equidistant_at,
)

PAIR_AGE_S = 0.1
"""Positions that are this near in time describe one moment, once the way between is added."""

# On a sphere of radius 1 metres are angles.
_ANGLES = AzimuthalEquidistant(1.0, 1.0)
# A pair is good to 2 cm (1e-7 degree is 1.1 cm), the length that is assumed at first to half a
# percent: 4 m from the start both weigh the same.
_ASSUMED_FOR_M = 4.0
# Of a pair that is little farther away than the last there is little to learn.
_FARTHER = 1.1
# A pair that is farther off than any projection is one of another place, or a turned frame.
_OFF_MAX = 0.01
_JUDGED_FROM_M = 20.0


class FrameFinder:
    """Follows one vehicle from one start of its autopilot to the next.

    Attributes:
        frame: the local frame, None until its origin is known. An origin that the autopilot
            reported may move. One from a pair stays, so that the frame does not wander, but for
            what is learned of the projection.
        wants_pairs: whether there is anything to learn from a pair.
    """

    def __init__(self, projection: Projection | None) -> None:
        """Begin with the projection of the firmware; None: it is to be measured."""
        self._projection = projection
        self._anchor: tuple[Geodetic, Vector3] | None = None
        self._origin: Geodetic | None = None
        self._axes: tuple[_Axis, _Axis] | None = None
        self.frame: LocalFrame | None = None
        self.wants_pairs = True

    def take_origin(self, origin: Geodetic) -> None:
        """Take the origin from the vehicle itself (GPS_GLOBAL_ORIGIN)."""
        if origin != self._origin:
            self._origin = origin
            self._begin(origin, (0.0, 0.0, 0.0))

    def pair(self, place: Geodetic, position_ned_m: Vector3) -> None:
        """Take where the vehicle is, on earth and in its local frame, at one moment."""
        if self._anchor is None:
            self._begin(place, position_ned_m)
        elif self._axes is not None and self.frame is not None:
            anchor, anchor_ned_m = self._anchor
            origin = self.frame.origin
            here = _ANGLES.to_local(place[0], place[1], origin)
            there = _ANGLES.to_local(anchor[0], anchor[1], origin)
            learned = [
                axis.learn(here[i] - there[i], position_ned_m[i] - anchor_ned_m[i])
                for i, axis in enumerate(self._axes)
            ]
            if any(learned):
                self._lay(self._anchor, _measured(self._axes))

    def _begin(self, place: Geodetic, position_ned_m: Vector3) -> None:
        self._anchor = anchor = place, position_ned_m
        projection = self._projection
        if projection is None:
            assumed = equidistant_at(place[0])
            self._axes = axes = _Axis(assumed.radius_north_m), _Axis(assumed.radius_east_m)
            projection = _measured(axes)
        self._lay(anchor, projection)

    def _lay(self, anchor: tuple[Geodetic, Vector3], projection: Projection) -> None:
        """Lay the frame through its anchor; after that only the projection can be learned."""
        self.wants_pairs = self._projection is None
        place, position_ned_m = anchor
        if self._origin is not None:
            self.frame = LocalFrame(self._origin, projection)
        else:
            self.frame = LocalFrame.through(place, position_ned_m, projection)


class _Axis:
    """The length of a firmware's metres in one direction, as the radius of an earth."""

    def __init__(self, assumed_m: float) -> None:
        self.radius_m = assumed_m
        self._assumed_m = assumed_m
        self._farthest_m = 0.0

    def learn(self, angle_rad: float, way_m: float) -> bool:
        """Take an angle on the earth and its metres in the frame; return whether it helps."""
        away_m = abs(angle_rad * self._assumed_m)
        if away_m <= self._farthest_m * _FARTHER:
            return False
        if abs(way_m - angle_rad * self._assumed_m) > _OFF_MAX * max(away_m, _JUDGED_FROM_M):
            return False
        self._farthest_m = away_m
        assumed = (_ASSUMED_FOR_M / self._assumed_m) ** 2
        self.radius_m = (self._assumed_m * assumed + way_m * angle_rad) / (assumed + angle_rad**2)
        return True


def _measured(axes: tuple[_Axis, _Axis]) -> Projection:
    """Return the projection by the lengths of metres north and east."""
    return AzimuthalEquidistant(*(axis.radius_m for axis in axes))
