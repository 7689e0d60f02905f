"""GUIDED of ArduPlane: round a point, or along a heading."""

from __future__ import annotations

import math
from typing import NamedTuple

from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import Loiter
from mavlink_sitl.autopilot.control import l1_guidance as l1
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import ItemReached, Vector

TURN_IN_S = 2.0
"""From an error of the heading to a rate of turn"""


class Heading(NamedTuple):
    """GUIDED_CHANGE_HEADING.

    Attributes:
        angle_rad: from North.
        course: it is that over ground, not the nose's.
        most_m_s2: no more acceleration sideways.
    """

    angle_rad: float
    course: bool
    most_m_s2: float


class Guided(Loiter):
    """Round a point: first the one where it was chosen, then that of DO_REPOSITION.

    Of setpoints only the height of SET_POSITION_TARGET_GLOBAL_INT and of an offset in NED is
    taken; everything else has no effect and gets no word.
    """

    def enter(self) -> None:
        """Round this point."""
        self._told = False
        self.slope_from = None
        self._heading: Heading | None = None
        self._height_rate_m_s = math.inf
        self.radius_m = 0.0
        super().enter()

    def update(self) -> None:
        """Fly a circle, or along a heading; report the circle once, when it is reached."""
        if self._heading is None:
            super().update()
        elif self.target is not None:
            self.on_circle = False
            self.fly(self._bank_to(self._heading), self.climb_to(self.target[2]))
        if self.on_circle and not self._told:
            self._told = True
            self.vehicle.events.append(ItemReached(0))

    def reposition(self, place: Vector, radius_m: float = 0.0) -> None:
        """Another point; no heading or rate of climb of before lasts."""
        self._told = self.on_circle = False
        self.slope_from = self.vehicle.motion[:3]
        self._heading, self._height_rate_m_s = None, math.inf
        self.radius_m = radius_m
        self.go_round(place)

    def setpoint(self, setpoint: Setpoint) -> None:
        """Set the altitude of a setpoint, if its kind has one that counts."""
        assert self.target is not None
        if setpoint.position_m is None:
            return
        if setpoint.frame is SetpointFrame.OFFSET:
            down = self.vehicle.motion.down_m + setpoint.position_m[2]
        elif setpoint.is_global:
            down = setpoint.position_m[2]
        else:
            return
        self.slope_from = None
        self.go_round((self.target[0], self.target[1], down))

    def climb_to(self, down_m: float) -> float:
        """See `PlaneMode`; no faster than GUIDED_CHANGE_ALTITUDE says."""
        most = self._height_rate_m_s
        return min(max(super().climb_to(self.sloped_down_m(down_m)), -most), most)

    def change_height(self, down_m: float, rate_m_s: float) -> None:
        """GUIDED_CHANGE_ALTITUDE: another height of the circle or course, NED; 0 for any rate."""
        assert self.target is not None
        self._height_rate_m_s = abs(rate_m_s) or math.inf
        self.slope_from = None
        self.target = (self.target[0], self.target[1], down_m)

    def change_heading(self, heading: Heading | None) -> None:
        """GUIDED_CHANGE_HEADING: a straight line, or round its point again."""
        self._heading = heading

    def _bank_to(self, heading: Heading) -> float:
        m = self.vehicle.motion
        now = math.atan2(m.velocity_east_m_s, m.velocity_north_m_s) if heading.course else m.yaw_rad
        error = math.remainder(heading.angle_rad - now, math.tau)
        sideways = error * max(m.speed_m_s, 1.0) / TURN_IN_S
        sideways = min(max(sideways, -heading.most_m_s2), heading.most_m_s2)
        return l1.bank_rad(sideways, self.bank_limit_rad())
