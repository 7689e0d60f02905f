"""ArduPlane: the firmware of one fixed-wing aeroplane. Rules observed in `plane_guided`."""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_sitl.autopilot.arming import Arming
from mavlink_sitl.autopilot.copter import Copter
from mavlink_sitl.autopilot.failsafe import Failsafes
from mavlink_sitl.autopilot.guided import Setpoint
from mavlink_sitl.autopilot.modes import Mode
from mavlink_sitl.autopilot.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.autopilot.navigation_report import NavigationReport
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.plane_modes import (
    Circle,
    Cruise,
    Guided,
    Loiter,
    PlaneMode,
    ReturnToLaunch,
    Stick,
    TakeOff,
)
from mavlink_sitl.exchange import (
    Guidance,
    LandedState,
    Limits,
    ModeChanged,
    Observation,
    Result,
    Severity,
    SystemStatus,
)
from mavlink_sitl.geodesy import GeoPoint
from mavlink_sitl.guidance import GlideGuidance

BEHAVIOURS: dict[str, Callable[[Plane, ModeSpec], PlaneMode]] = {
    "stick": Stick,
    "cruise": Cruise,
    "circle": Circle,
    "loiter": Loiter,
    "rtl": ReturnToLaunch,
    "takeoff": TakeOff,
    "guided": Guided,
    "auto": Loiter,
}
MODE_RTL, MODE_LOITER, MODE_GUIDED = 11, 12, 15
FLYING_M_S = 4.0
STANDING_M_S = 3.0
STEP_S = 0.05
LANDED_TO_DISARM_S = 20.0
"""LAND_DISARMDELAY"""


class PlaneArming(Arming):
    """An armed plane on the ground stays armed until it has flown."""

    def disarm_is_due(self, landed_since_s: float) -> bool:
        """Some time after a landing."""
        plane = self._copter
        if not isinstance(plane, Plane) or not self.armed or not plane.landed_at_s:
            return False
        return plane.landed and plane.now_s - plane.landed_at_s >= LANDED_TO_DISARM_S


class PlaneFailsafes(Failsafes):
    """The same failsafes; every action is RTL, and the estimator's has none."""

    def _act(self, copter: Copter, mode: int | None) -> None:
        if mode is not None:
            copter.enter_mode(MODE_RTL)

    def _estimator(self, copter: Copter) -> None:
        self.estimator_lost = False


class PlaneNavigator(Navigator):
    """Origin, home and limits of a plane."""

    def cruise_m_s(self) -> float:
        """The indicated airspeed it keeps."""
        p = self._parameters
        wanted = self._speed_xy_m_s or p["AIRSPEED_CRUISE"]
        return max(min(max(wanted, p["AIRSPEED_MIN"]), p["AIRSPEED_MAX"]), LEAST_LIMIT)

    def limits(self) -> Limits:
        """Only the speed means something."""
        return Limits(speed_xy_m_s=self.cruise_m_s())


class Plane(Copter):
    """An aeroplane from power-up to the next. Arguments and attributes as of `Copter`.

    Attributes:
        landed_at_s: when it last touched down; 0 before.
        true_over_indicated: true airspeed over indicated.
        step_s: between two updates.
    """

    true_over_indicated = 1.06
    step_s = STEP_S

    def __init__(
        self,
        personality: Personality,
        parameters: Parameters,
        origin: GeoPoint,
        observation: Observation,
        ready_after_s: float,
    ) -> None:
        """See `Copter`."""
        self._flying = False
        self.landed_at_s = 0.0
        self.airspeed_m_s = 0.0
        super().__init__(personality, parameters, origin, observation, ready_after_s)
        self.failsafe = PlaneFailsafes()
        self.arming = PlaneArming(self)

    def make_navigator(self, origin: GeoPoint) -> PlaneNavigator:
        """See `Copter`."""
        return PlaneNavigator(origin, self.parameters)

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

    def observe(self, observation: Observation) -> None:
        """See `Copter`; learns whether it flies."""
        super().observe(observation)
        m = observation.motion
        speed = math.hypot(m.velocity_north_m_s, m.velocity_east_m_s)
        self.airspeed_m_s = (
            speed / self.true_over_indicated
            if observation.airspeed_m_s is None
            else observation.airspeed_m_s
        )
        if self.arming_or_none() and speed > FLYING_M_S:
            self._flying = True
        elif self._flying and observation.touching_ground and speed < STANDING_M_S:
            self._flying = False
            self.landed_at_s = observation.time_s

    def arming_or_none(self) -> bool:
        """Whether it is armed; also before there is an `arming`."""
        arming = getattr(self, "arming", None)
        return isinstance(arming, Arming) and arming.armed

    @property
    def landed(self) -> bool:
        """Whether it stands."""
        return not self._flying

    @property
    def landed_state(self) -> LandedState:
        """For EXTENDED_SYS_STATE."""
        if not self._flying:
            return LandedState.ON_GROUND
        return LandedState.TAKEOFF if self.mode.taking_off else LandedState.IN_AIR

    @property
    def system_status(self) -> SystemStatus:
        """For HEARTBEAT."""
        if not self.started:
            return SystemStatus.CALIBRATING
        if self.failsafe.active:
            return SystemStatus.CRITICAL
        return SystemStatus.ACTIVE if self._flying else SystemStatus.STANDBY

    @property
    def wanted(self) -> Guidance:
        """What its mode asked for last."""
        return self._wanted

    def cruise_m_s(self) -> float:
        """The indicated airspeed it keeps."""
        assert isinstance(self.navigator, PlaneNavigator)
        return self.navigator.cruise_m_s()

    def sticks(self) -> tuple[float, float, float]:
        """Roll and pitch, -1..1, pitch up; throttle, 0..1."""
        channels = self.pilot.channels(self.now_s, self.parameters["RC_OVERRIDE_TIME"])
        roll, pitch = ((channels[i] - 1500) / 500.0 for i in (0, 1))
        throttle = (channels[2] - 1000) / 1000.0
        return (
            min(max(roll, -1.0), 1.0),
            min(max(-pitch, -1.0), 1.0),
            min(max(throttle, 0.0), 1.0),
        )

    def navigation_report(self) -> NavigationReport | None:
        """For NAV_CONTROLLER_OUTPUT; None in modes that a pilot flies."""
        if not self.mode.spec.requires_position:
            return None
        centre = self.mode.centre if isinstance(self.mode, PlaneMode) else None
        if centre is None or not isinstance(self._wanted, GlideGuidance):
            return NavigationReport()
        m = self.motion
        north, east = centre[0] - m.north_m, centre[1] - m.east_m
        bearing = math.degrees(math.atan2(east, north))
        assert isinstance(self.mode, PlaneMode)
        return NavigationReport(
            roll_deg=math.degrees(self._wanted.bank_rad),
            pitch_deg=math.degrees(m.pitch_rad),
            bearing_deg=bearing,
            target_bearing_deg=bearing,
            distance_m=math.hypot(north, east),
            altitude_error_m=m.down_m - centre[2],
            airspeed_error_m_s=self.cruise_m_s() - self.airspeed_m_s,
            cross_track_m=self.mode.outside_m,
        )

    def destination_ned_m(self) -> tuple[float, float, float] | None:
        """What it circles, for POSITION_TARGET_GLOBAL_INT."""
        return self.mode.centre if isinstance(self.mode, PlaneMode) else None

    # What people want of it.

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        if self.personality.modes[number].behaviour == "auto" and not self.has_mission:
            self.say(Severity.WARNING, "Mode change to AUTO failed: init failed")
            return False
        return super().enter_mode(number)

    def take_off(self, altitude_above_home_m: float) -> Result:
        """NAV_TAKEOFF is for those that lift off vertically."""
        return Result.FAILED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided):
            self.mode.setpoint(setpoint)

    def go_to(self, setpoint: Setpoint) -> None:
        """DO_REPOSITION: circle another point."""
        if isinstance(self.mode, Guided) and setpoint.position_m is not None:
            self.mode.reposition(setpoint.position_m)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: of the kinds only airspeed (0) means something."""
        p = self.parameters
        if kind != 0 or not p["AIRSPEED_MIN"] <= speed_m_s <= p["AIRSPEED_MAX"]:
            return Result.FAILED
        return Result.ACCEPTED if self.navigator.change_speed(0, speed_m_s) else Result.FAILED

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: planes cannot."""
        return Result.FAILED
