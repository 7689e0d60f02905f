"""Take-off of PX4's planes: along the runway, then climbing."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.px4.mode import TakeoffMode
from mavlink_sitl.autopilot.px4.navigation import within
from mavlink_sitl.autopilot.px4.plane import path_guidance
from mavlink_sitl.autopilot.px4.plane.path_guidance import Point
from mavlink_sitl.autopilot.px4.plane.plane_modes import PlaneMode
from mavlink_sitl.exchange import Motors, Severity, Vector
from mavlink_sitl.guidance import GlideGuidance

ROTATE_SHARE = 0.9
"""It rotates at this part of the take-off airspeed, unless RWTO_ROT_AIRSPD says otherwise"""


class Climbout:
    """The run and the climb, from arming on.

    With RWTO_TKOFF the throttle opens over RWTO_RAMP_TIME and the nose stays down until the
    speed of rotation; without, it is thrown, and pushes at once.

    Args:
        mode: whose take-off it is.
        down_m: how high, NED.
        towards: the place whose bearing is kept; where the nose points when None.
    """

    def __init__(self, mode: PlaneMode, down_m: float, towards: Point | None = None) -> None:
        self._mode = mode
        self._vehicle = mode.vehicle
        self.down_m = down_m
        self._towards = towards
        self._began_s: float | None = None
        self._rolling = False

    @property
    def done(self) -> bool:
        """Whether the height is reached."""
        return self._vehicle.motion.down_m <= self.down_m

    def update(self) -> None:
        """Run one step."""
        plane, mode, p = self._vehicle, self._mode, self._vehicle.parameters
        if not plane.armed:
            mode.rest()
            return
        if self._began_s is None:
            self._begin()
        assert self._began_s is not None
        if self._rolling:
            ramp_s = within(p["RWTO_RAMP_TIME"], 0.01, 60.0)
            share = (plane.now_s - self._began_s) / ramp_s
            self._rolling = share < 1.0 or plane.airspeed_m_s < self._rotate_m_s()
            if self._rolling:
                throttle = min(share, 1.0) * within(p["RWTO_MAX_THR"], 0.0, 1.0)
                mode.guide(GlideGuidance(motors=Motors.MANUAL, throttle=throttle))
                return
        mode.place = (*mode.level(), self.down_m)
        path = path_guidance.line(mode.level(), self._start, self._end)
        climb = within(p["FW_T_CLMB_MAX"], 0.1, 20.0)
        mode.fly(path, climb, plane.takeoff_m_s(), full_throttle=True)

    def _begin(self) -> None:
        plane, mode = self._vehicle, self._mode
        self._began_s = plane.now_s
        self._rolling = plane.landed and int(plane.parameters["RWTO_TKOFF"]) != 0
        self._start = mode.level()
        away = self._towards or self._start
        along = path_guidance.unit(
            away[0] - self._start[0],
            away[1] - self._start[1],
            (math.cos(plane.motion.yaw_rad), math.sin(plane.motion.yaw_rad)),
        )
        self._end = (self._start[0] + along[0], self._start[1] + along[1])

    def _rotate_m_s(self) -> float:
        most, own = self._vehicle.takeoff_m_s(), self._vehicle.parameters["RWTO_ROT_AIRSPD"]
        return min(own, most) if own > 0.0 else ROTATE_SHARE * most


class Takeoff(PlaneMode, TakeoffMode):
    """AUTO.TAKEOFF: straight on to a height above sea level, then AUTO.LOITER there."""

    def enter(self) -> None:
        """Wait for arming."""
        self.level_off()
        self._climbout: Climbout | None = None
        self.update()

    def _begin(self) -> Climbout | None:
        """Set the altitude; one below the vehicle is not flown to."""
        plane, navigator = self.vehicle, self.vehicle.navigator
        here, height = plane.motion.down_m, plane.parameters["MIS_TAKEOFF_ALT"]
        wanted = here - height
        if self.wanted_amsl_m is not None:
            wanted = navigator.down_of_amsl(self.wanted_amsl_m)
        else:
            plane.say(Severity.INFO, f"Using default takeoff altitude: {height:.1f} m")
        self.wanted_amsl_m = None
        if wanted > here:
            plane.say(Severity.CRITICAL, "Already higher than takeoff altitude")
            return None
        return Climbout(self, wanted)

    def update(self) -> None:
        """Climb; at the height circle where it is."""
        if not self.vehicle.armed:
            self.rest()
            return
        if self._climbout is None:
            self._climbout = self._begin()
        climbout = self._climbout
        if climbout is None or (self.vehicle.in_flight and climbout.done):
            down = self.vehicle.motion.down_m if climbout is None else climbout.down_m
            target: Vector = (*self.level(), down)
            self.vehicle.hold_at(target)
        else:
            climbout.update()
