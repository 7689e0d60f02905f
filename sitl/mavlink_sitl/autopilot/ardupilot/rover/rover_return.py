"""RTL and SMART_RTL of rovers and boats. RTL was recorded in `rover_guided`."""

from __future__ import annotations

from mavlink_sitl.autopilot.ardupilot.rover.moving_reference import CORNER_M_S, LegReference, Point
from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import DriveMode
from mavlink_sitl.autopilot.safety.rally import return_point_ned_m
from mavlink_sitl.exchange import Severity


class ReturnToLaunch(DriveMode):
    """Back home or to a rally point; it says when it is there, and stays in RTL, armed."""

    def enter(self) -> None:
        """Set off."""
        self.route = LegReference(
            self.vehicle, return_point_ned_m(self.vehicle)[:2], self.speed_m_s()
        )
        self._said = False

    def speed_m_s(self) -> float:
        """The speed of the return."""
        return self.vehicle.parameters["RTL_SPEED"] or self.vehicle.cruise_m_s()

    def update(self) -> None:
        """Run one step."""
        if self.route is None or not self.vehicle.armed:
            return
        if not self.route.reached or self.goes_on():
            self.drive(self.route.follow())
            return
        if not self._said:
            self._said = True
            self.vehicle.say(Severity.INFO, "Reached destination")
        self.vehicle.rest_at(self, self.route.destination)

    def goes_on(self) -> bool:
        """Whether another leg begins where this one ended."""
        return False


class SmartReturn(ReturnToLaunch):
    """SMART_RTL: back the way it came, without the loops of it."""

    def enter(self) -> None:
        """Brake, and find the corners of the way."""
        self._said = False
        crumbs = self.vehicle.trail.crumbs
        self._points = crumbs.shortest() if crumbs is not None else []
        self._next_leg(self.vehicle.stopping_point(), 0.0)

    def _next_leg(self, start: Point, speed_m_s: float) -> None:
        """To the next corner."""
        rover = self.vehicle
        destination = start
        if self._points:
            north, east = self._points.pop()
            destination = (north, east)
        leaving = min(CORNER_M_S, self.speed_m_s()) if self._points else 0.0
        self.route = LegReference(rover, destination, self.speed_m_s(), start, speed_m_s, leaving)

    def goes_on(self) -> bool:
        """Round the corner, while there are any."""
        if not self._points or self.route is None:
            return False
        self._next_leg(self.route.destination, self.vehicle.motion.speed_m_s)
        return True
