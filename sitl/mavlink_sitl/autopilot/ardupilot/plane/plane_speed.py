"""A plane's speeds, and its automatic disarming."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.safety.arming import Arming
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.exchange import Limits, Motion, Result, Severity

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane

NO_CHANGE = -2.0
"""A speed in DO_CHANGE_SPEED: what the parameters say again"""


class PlaneArming(Arming):
    """An armed plane on the ground stays armed, unless a mission has landed it."""

    _vehicle: Plane

    def disarm_is_due(self, landed_since_s: float) -> bool:
        """LAND_DISARMDELAY after a landing in AUTO."""
        plane = self._vehicle
        delay_s = plane.parameters["LAND_DISARMDELAY"]
        if not self.armed or not plane.landed or not landed_since_s or not plane.mode.landing:
            return False
        due = delay_s > 0.0 and plane.now_s - landed_since_s >= delay_s
        if due:
            plane.say(Severity.INFO, "Auto disarmed")
        return due

    def disarm(self, force: bool) -> Result:
        """See `Arming`; in AUTO the mission stays where it is."""
        plans = self._vehicle.plans
        place = plans.current
        result = super().disarm(force)
        if self._vehicle.mode is self._vehicle.auto:
            plans.current = place
        return result


class PlaneNavigator(Navigator):
    """Origin, home and limits of a plane."""

    _ground_m_s: float | None = None
    _over_ground_m_s = 0.0

    def observe(self, motion: Motion, lost: bool) -> None:
        """See `Navigator`; the speed over ground may have to be kept."""
        super().observe(motion, lost)
        self._over_ground_m_s = motion.speed_m_s

    def change_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another airspeed (0) within the limits until the mode changes, or least speed (1)."""
        p = self._parameters
        if kind == 1:
            self._ground_m_s = max(speed_m_s, 0.0)
        elif kind == 0 and speed_m_s == NO_CHANGE:
            self._speed_xy_m_s = None
        elif kind == 0 and p["AIRSPEED_MIN"] <= speed_m_s <= p["AIRSPEED_MAX"]:
            self._speed_xy_m_s = speed_m_s
        else:
            return False
        return True

    def cruise_m_s(self) -> float:
        """The indicated airspeed it keeps; more when the wind makes it too slow over ground."""
        p = self._parameters
        wanted = self._speed_xy_m_s or p["AIRSPEED_CRUISE"]
        least = p["MIN_GROUNDSPEED"] if self._ground_m_s is None else self._ground_m_s
        wanted += max(least - self._over_ground_m_s, 0.0)
        return max(min(max(wanted, p["AIRSPEED_MIN"]), p["AIRSPEED_MAX"]), LEAST_LIMIT)

    def limits(self) -> Limits:
        """Only the speed means something."""
        return Limits(speed_xy_m_s=self.cruise_m_s())
