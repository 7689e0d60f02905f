"""ArduRover: the firmware of one car or boat. Rules observed in `rover_guided` are tests."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from mavlink_sitl.autopilot.ardupilot.rover.moving_reference import Point
from mavlink_sitl.autopilot.ardupilot.rover.pilot_modes import Acro, Manual, Steering
from mavlink_sitl.autopilot.ardupilot.rover.rover_auto import DriveAuto, Obey
from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import (
    DriveMode,
    Guided,
    Hold,
    Loiter,
    ReturnToLaunch,
    SmartReturn,
)
from mavlink_sitl.autopilot.ardupilot.rover.rover_motor_test import RoverMotorTest
from mavlink_sitl.autopilot.ardupilot.rover.rover_safety import RoverFailsafes, RoverFence
from mavlink_sitl.autopilot.common.commander import Commander, PowerUp
from mavlink_sitl.autopilot.common.firmware import Firmware, Inputs, Landing
from mavlink_sitl.autopilot.plans.plans import Cmd
from mavlink_sitl.autopilot.state.breadcrumbs import Trail
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.autopilot.state.setpoint import DriveTarget, Setpoint
from mavlink_sitl.exchange import (
    LandedState,
    Limits,
    NavigationReport,
    Observation,
    Result,
    Severity,
    Vector,
)

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.ardupilot.rover.rover_modes import DriveMode

MODE_RTL, MODE_GUIDED = 11, 15
CENTRED_US = 1500
GRAVITY_M_S2 = 9.81
STEER_LEAST_M_S = 1.0
"""Below this speed turns are limited as if at it"""


class DriveNavigator(Navigator):
    """Origin, home and limits of a rover."""

    def change_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another speed until the next change of mode; there is only one kind of it."""
        return kind in (0, 1) and super().change_speed(kind, speed_m_s)

    def cruise_m_s(self) -> float:
        """The cruise speed."""
        p = self._parameters
        return max(self._speed_xy_m_s or p["WP_SPEED"] or p["CRUISE_SPEED"], LEAST_LIMIT)

    def limits(self) -> Limits:
        """Speed and acceleration."""
        acceleration = max(self._parameters["ATC_ACCEL_MAX"], LEAST_LIMIT)
        return Limits(speed_xy_m_s=self.cruise_m_s(), acceleration_xy_m_s2=acceleration)


def _never_landed(landing: Landing, _: Inputs) -> Landing:
    """It knows of no ground."""
    return landing._replace(landed=False)


class Rover(Commander):
    """A car or a boat from power-up to the next. Arguments as of `Copter`.

    Attributes:
        trail: the way since it was armed, for SMART_RTL.
        backwards: whether ways are driven tail first (DO_SET_REVERSE), until the mode changes.
    """

    navigator: DriveNavigator
    table = Firmware(
        modes={
            "manual": Manual,
            "acro": Acro,
            "steering": Steering,
            "hold": Hold,
            "loiter": Loiter,
            "auto": DriveAuto,
            "rtl": ReturnToLaunch,
            "smart_rtl": SmartReturn,
            "guided": Guided,
        },
        navigator=DriveNavigator,
        failsafes=RoverFailsafes,
        fence=RoverFence,
        landing=_never_landed,
        reports_start=True,
    )

    def __init__(self, start: PowerUp) -> None:
        super().__init__(start)
        self.trail = Trail(self, coordinates=2)
        self.backwards = False
        self.motor_test = RoverMotorTest(self)
        self.pilot.receive((0, 0, CENTRED_US))
        self.mode.enter()

    def watch(self, observation: Observation) -> None:
        """See `Commander`; remembers the way it has come."""
        super().watch(observation)
        self.trail.watch(not isinstance(self.mode, SmartReturn))

    def update(self, observation: Observation) -> None:
        """See `Commander`; a motor test comes before what its mode wants."""
        super().update(observation)
        self.motor_test.update()

    # State.

    @property
    def landed_state(self) -> LandedState:
        """Always undefined."""
        return LandedState.UNDEFINED

    def is_active(self) -> bool:
        """Even disarmed; not in HOLD, even armed."""
        return not isinstance(self.mode, Hold)

    def turn_limit_rad_s(self, speed_m_s: float) -> float:
        """The largest turn rate at a speed: ATC_STR_RAT_MAX, and sideways ATC_TURN_MAX_G."""
        p = self.parameters
        sideways_m_s2 = p["ATC_TURN_MAX_G"] * GRAVITY_M_S2
        limit = sideways_m_s2 / max(abs(speed_m_s), STEER_LEAST_M_S)
        return max(min(math.radians(p["ATC_STR_RAT_MAX"]), limit), math.radians(1.0))

    def sticks(self) -> tuple[float, float]:
        """Steering and throttle, -1..1."""
        return self.radio.stick("Roll", self.now_s), self.radio.stick("Throttle", self.now_s)

    def stopping_point(self) -> Point:
        """The point at which it would stop if it braked now."""
        m = self.motion
        speed = m.speed_m_s
        ahead = speed / (2.0 * self.navigator.limits().acceleration_xy_m_s2)
        return m.north_m + m.velocity_north_m_s * ahead, m.east_m + m.velocity_east_m_s * ahead

    @property
    def guided(self) -> Guided:
        """The GUIDED mode, whether it drives or not."""
        return self.mode_of(Guided)

    def rest_at(self, mode: DriveMode, place: Point) -> None:
        """The guidance after arrival: a car stops, a boat holds its position."""
        if self.personality.kind == "boat":
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

    def destination_ned_m(self) -> Vector | None:
        """The destination, for POSITION_TARGET_GLOBAL_INT."""
        route = self.mode.route if isinstance(self.mode, DriveMode) else None
        return None if route is None else (*route.destination, 0.0)

    # Requests by people.

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        if self.personality.modes[number].behaviour == "auto" and not self.auto.has_mission:
            self.say(Severity.NOTICE, "No Mission. Can't set AUTO.")
            return False
        if self.personality.modes[number].behaviour == "smart_rtl" and not self.trail.known:
            self.say(Severity.WARNING, "Flight mode change failed")
            return False
        return super().enter_mode(number)

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motor, also while it rolls: then it rolls on."""
        return super().disarm(True)

    def save_waypoint(self) -> None:
        """See `Commander`; disarmed it forgets the mission, and home is here."""
        if isinstance(self.mode, DriveAuto):
            return
        if self.armed:
            self.auto.append_here(Cmd.WAYPOINT)
            return
        self.auto.clear()
        self.say(Severity.NOTICE, "SaveWP: Mission cleared!")
        self.set_home()

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored where no companion is obeyed."""
        if self._obeys():
            self.guided.setpoint(setpoint)

    def attitude(self, target: DriveTarget) -> None:
        """SET_ATTITUDE_TARGET: a share of the speed, and a rate of turn or a heading."""
        if self._obeys():
            self.guided.go(target)

    def _obeys(self) -> bool:
        """Whether GUIDED drives: as the mode, or for an item of AUTO."""
        task = self.mode.task if isinstance(self.mode, DriveAuto) else None
        return self.mode is self.guided or (isinstance(task, Obey) and task.begins)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: in modes that drive by themselves; in GUIDED on the way to a place."""
        mode = self.mode
        waits = isinstance(mode, Guided) and mode.route is None
        if not mode.spec.requires_position or waits:
            return Result.FAILED
        if not self.navigator.change_speed(kind, speed_m_s):
            return Result.FAILED
        if isinstance(mode, DriveMode) and mode.route is not None:
            mode.route.change_speed(self.navigator.cruise_m_s())
        elif isinstance(mode, DriveAuto):
            mode.limits_changed()
        return Result.ACCEPTED
