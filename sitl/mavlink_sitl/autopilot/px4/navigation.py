"""Origin, home and limits by PX4's parameters."""

from __future__ import annotations

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.state.navigation import Navigator
from mavlink_sitl.exchange import Vector
from mavlink_sitl.geodesy import GeoPoint, LocalFrame


def within(value: float, least: float, most: float) -> float:
    """A number within limits, whatever a parameter says."""
    return min(max(value, least), most)


class Px4Navigator(Navigator):
    """A `Navigator` that also knows the true home: the altitude of the firmware's home drifts."""

    def __init__(self, frame: LocalFrame, parameters: Parameters) -> None:
        super().__init__(frame, parameters)
        self._true_home: GeoPoint | None = None

    def place_ned_m(self, point: GeoPoint) -> Vector:
        """A place on earth in the local frame."""
        return self.frame.to_local(point)

    def down_of_amsl(self, altitude_amsl_m: float) -> float:
        """An altitude in the local frame."""
        return self.origin.altitude_amsl_m - altitude_amsl_m

    def set_home(self) -> None:
        """Home is here."""
        super().set_home()
        self._true_home = self.home

    def true_home_ned_m(self) -> Vector:
        """Home in the local frame, before any drift."""
        return (0.0, 0.0, 0.0) if self._true_home is None else self.place_ned_m(self._true_home)

    def true_home_down_m(self) -> float:
        """Home's height in the local frame, before any drift."""
        if self._true_home is None:
            return 0.0
        return self.down_of_amsl(self._true_home.altitude_amsl_m)

    def set_home_at(self, point: GeoPoint) -> None:
        """Home is there."""
        self.home = self._true_home = point

    def drift_home(self, offset_m: float) -> None:
        """Home's altitude is off by this much for now; its place stays."""
        if self._true_home is not None:
            altitude = self._true_home.altitude_amsl_m + offset_m
            self.home = self._true_home._replace(altitude_amsl_m=altitude)
