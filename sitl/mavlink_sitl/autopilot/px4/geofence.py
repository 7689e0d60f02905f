"""PX4's geofence: a distance from home, a height above it, and the uploaded areas.

Read in the firmware (geofence, commander's checks): a breach forbids arming, and in flight
`failsafe` answers it with GF_ACTION. An area that does not contain home, or the vehicle when
it flies, is said to be invalid and left out. No message reports the state of the fence:
PX4 has no FENCE_STATUS.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.fence import CIRCLE, HEIGHT, POLYGON, Area, Fence, areas_of
from mavlink_sitl.autopilot.state.setpoint import Setpoint
from mavlink_sitl.exchange import Severity, Vector

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle

TEXTS = {
    CIRCLE: "Geofence: exceeding maximum distance to Home",
    HEIGHT: "Geofence: exceeding maximum altitude above Home",
    POLYGON: "Geofence: approaching or outside geofence",
}
NO_HOME = "Geofence invalid, doesn't contain Home position"
NOT_HERE = "Geofence invalid, doesn't contain current vehicle position"


class Px4Geofence(Fence):
    """The geofence of one vehicle."""

    _vehicle: Px4Vehicle

    @property
    def enabled(self) -> bool:
        """Whether a breach has consequences (GF_ACTION)."""
        return self._vehicle.parameters["GF_ACTION"] != 0.0

    def blocks(self, setpoint: Setpoint) -> bool:
        """PX4 takes any setpoint, and acts when the vehicle gets there."""
        return False

    def reasons(self) -> list[str]:
        """They show in the one bit of SYS_STATUS."""
        return []

    def broken_at(self, position_ned_m: Vector) -> int:
        """The bits `CIRCLE`, `HEIGHT` and `POLYGON` that a place breaks."""
        vehicle, (north, east, down) = self._vehicle, position_ned_m
        p, home = vehicle.parameters, vehicle.navigator.home
        broken = 0
        if home is not None:
            home_north, home_east, home_down = vehicle.navigator.frame.to_local(home)
            away_m = math.hypot(north - home_north, east - home_east)
            if 0.0 < p["GF_MAX_HOR_DIST"] <= away_m:
                broken |= CIRCLE
            if 0.0 < p["GF_MAX_VER_DIST"] <= home_down - down:
                broken |= HEIGHT
        if not all(area.allows((north, east)) for area in self._areas):
            broken |= POLYGON
        return broken

    def update(self) -> None:
        """Look where the vehicle is."""
        vehicle = self._vehicle
        plan = vehicle.plans.fence
        # Without home and a position nothing can be judged yet.
        if vehicle.navigator.home is None or not vehicle.estimator.position_ok:
            self.breached = 0
            return
        if plan.changes != self._areas_of:
            self._areas_of = plan.changes
            areas = areas_of(plan.items, vehicle.navigator.frame)
            self._areas = [area for area in areas if self._usable(area)]
        broken = self.broken_at(vehicle.motion[:3]) if self.enabled else 0
        new, self.breached = broken & ~self.breached, broken
        for bit, text in TEXTS.items():
            if new & bit:
                vehicle.say(Severity.CRITICAL, text)

    def _usable(self, area: Area) -> bool:
        vehicle = self._vehicle
        home = vehicle.navigator.home_ned_m()
        if not area.allows(home[:2]):
            vehicle.say(Severity.CRITICAL, NO_HOME)
            return False
        if self.enabled and vehicle.in_flight and not area.allows(vehicle.motion[:2]):
            vehicle.say(Severity.CRITICAL, NOT_HERE)
            return False
        return True
