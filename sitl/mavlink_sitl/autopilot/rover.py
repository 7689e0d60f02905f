"""ArduRover: the firmware of one car or boat. Rules observed in `rover_guided` are tests."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_sitl.autopilot.copter import Copter
from mavlink_sitl.autopilot.failsafe import MODE_LAND, Failsafes
from mavlink_sitl.autopilot.guided import Setpoint
from mavlink_sitl.autopilot.modes import Mode
from mavlink_sitl.autopilot.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.autopilot.navigation_report import NavigationReport
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.route import Point
from mavlink_sitl.autopilot.rover_auto import DriveAuto
from mavlink_sitl.autopilot.rover_modes import (
    Acro,
    Circle,
    DriveMode,
    Guided,
    Hold,
    Loiter,
    Manual,
    ReturnToLaunch,
)
from mavlink_sitl.exchange import (
    LandedState,
    Limits,
    ModeChanged,
    Observation,
    Result,
    Severity,
    SystemStatus,
)
from mavlink_sitl.geodesy import GeoPoint

BEHAVIOURS: dict[str, Callable[[Rover, ModeSpec], DriveMode]] = {
    "manual": Manual,
    "acro": Acro,
    "hold": Hold,
    "loiter": Loiter,
    "circle": Circle,
    "auto": DriveAuto,
    "rtl": ReturnToLaunch,
    "guided": Guided,
}
MODE_HOLD, MODE_RTL, MODE_GUIDED = 4, 11, 15
CENTRED_US = 1500
FULL_STICK_US = 500.0


class DriveNavigator(Navigator):
    """Origin, home and limits of a rover."""

    def change_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another speed until the next change of mode; there is only one kind of it."""
        return kind in (0, 1) and super().change_speed(kind, speed_m_s)

    def cruise_m_s(self) -> float:
        """How fast it drives by itself."""
        p = self._parameters
        return max(self._speed_xy_m_s or p["WP_SPEED"] or p["CRUISE_SPEED"], LEAST_LIMIT)

    def limits(self) -> Limits:
        """Speed and acceleration."""
        acceleration = max(self._parameters["ATC_ACCEL_MAX"], LEAST_LIMIT)
        return Limits(speed_xy_m_s=self.cruise_m_s(), acceleration_xy_m_s2=acceleration)


class RoverFailsafes(Failsafes):
    """The same failsafes; what the numbers of the actions mean differs.

    BATT_FS_*_ACT: 1 is RTL, 2 is HOLD. A lost ground station is HOLD (FS_ACTION's default).
    """

    def _act(self, copter: Copter, mode: int | None) -> None:
        if mode is not None:
            wanted = MODE_RTL if mode == MODE_LAND else MODE_HOLD
            if not copter.enter_mode(wanted):
                copter.enter_mode(MODE_HOLD)

    def _estimator(self, copter: Copter) -> None:
        variance = copter.estimator.variance
        if variance and not self.estimator_lost and copter.armed:
            self.estimator_lost = True
            copter.say(Severity.CRITICAL, "EKF failsafe")
            if copter.mode.spec.requires_position:
                copter.enter_mode(MODE_HOLD)
        elif not variance:
            self.estimator_lost = False


class Rover(Copter):
    """A car or a boat from power-up to the next. Arguments and attributes as of `Copter`."""

    def __init__(
        self,
        personality: Personality,
        parameters: Parameters,
        origin: GeoPoint,
        observation: Observation,
        ready_after_s: float,
    ) -> None:
        """See `Copter`."""
        super().__init__(personality, parameters, origin, observation, ready_after_s)
        self.failsafe = RoverFailsafes()
        self.pilot.throttle_us = CENTRED_US
        self.mode.enter()

    def make_navigator(self, origin: GeoPoint) -> DriveNavigator:
        """See `Copter`."""
        return DriveNavigator(origin, self.parameters)

    def make_mode(self, spec: ModeSpec) -> Mode:
        """See `Copter`."""
        return BEHAVIOURS[spec.behaviour](self, spec)

    def update(self, observation: Observation) -> None:
        """See `Copter`; the end of starting is told at once."""
        was = self.started
        super().update(observation)
        if self.started and not was:
            self.events.append(ModeChanged(self.mode.spec.name, False))

    # What it knows.

    @property
    def landed(self) -> bool:
        """Never: it knows of no ground."""
        return False

    @property
    def landed_state(self) -> LandedState:
        """Always undefined."""
        return LandedState.UNDEFINED

    @property
    def system_status(self) -> SystemStatus:
        """ACTIVE even disarmed, STANDBY in HOLD even armed."""
        if not self.started:
            return SystemStatus.CALIBRATING
        if self.failsafe.active:
            return SystemStatus.CRITICAL
        return SystemStatus.STANDBY if isinstance(self.mode, Hold) else SystemStatus.ACTIVE

    @property
    def is_boat(self) -> bool:
        """Whether it drifts when it stops."""
        return self.personality.kind == "boat"

    def cruise_m_s(self) -> float:
        """How fast it drives by itself."""
        assert isinstance(self.navigator, DriveNavigator)
        return self.navigator.cruise_m_s()

    def sticks(self) -> tuple[float, float]:
        """Steering and throttle, -1..1."""
        channels = self.pilot.channels(self.now_s, self.parameters["RC_OVERRIDE_TIME"])
        steering = (channels[0] - CENTRED_US) / FULL_STICK_US
        throttle = (channels[2] - CENTRED_US) / FULL_STICK_US
        return min(max(steering, -1.0), 1.0), min(max(throttle, -1.0), 1.0)

    def stopping_point(self) -> Point:
        """Where it would stand if it braked now."""
        m = self.motion
        speed = math.hypot(m.velocity_north_m_s, m.velocity_east_m_s)
        ahead = speed / (2.0 * self.navigator.limits().acceleration_xy_m_s2)
        return m.north_m + m.velocity_north_m_s * ahead, m.east_m + m.velocity_east_m_s * ahead

    def rest_at(self, mode: DriveMode, place: Point) -> None:
        """What it does where it has arrived: a car stands, a boat keeps its place."""
        if self.is_boat:
            mode.stay_at(place)
        else:
            mode.stop()

    def navigation_report(self) -> NavigationReport | None:
        """For NAV_CONTROLLER_OUTPUT; None in modes that a pilot drives."""
        if not self.mode.spec.requires_position:
            return None
        route = self.mode.route if isinstance(self.mode, DriveMode) else None
        if route is None:
            return NavigationReport()
        m, (north, east) = self.motion, route.destination
        bearing = math.degrees(math.atan2(east - m.east_m, north - m.north_m)) % 360.0
        return NavigationReport(
            target_bearing_deg=bearing,
            distance_m=route.distance_m,
            cross_track_m=route.cross_track_m,
        )

    def destination_ned_m(self) -> tuple[float, float, float] | None:
        """Where it is going, for POSITION_TARGET_GLOBAL_INT."""
        route = self.mode.route if isinstance(self.mode, DriveMode) else None
        return None if route is None else (*route.destination, 0.0)

    # What people want of it.

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        if self.personality.modes[number].behaviour == "auto" and not self.has_mission:
            self.say(Severity.NOTICE, "No Mission. Can't set AUTO.")
            return False
        return super().enter_mode(number)

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motor, also while it rolls: then it rolls on."""
        return super().disarm(True)

    def take_off(self, altitude_above_home_m: float) -> Result:
        """A rover does not."""
        return Result.UNSUPPORTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided):
            self.mode.setpoint(setpoint)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: in modes that drive by themselves."""
        if not self.mode.spec.requires_position:
            return Result.FAILED
        return Result.ACCEPTED if self.navigator.change_speed(kind, speed_m_s) else Result.FAILED

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: not outside missions."""
        return Result.FAILED
