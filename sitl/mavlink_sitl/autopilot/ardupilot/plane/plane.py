"""ArduPlane: the firmware of one fixed-wing aeroplane. Rules observed in `plane_guided`."""

from __future__ import annotations

import math

from mavlink_sitl.autopilot.ardupilot.plane.pilot_modes import Cruise, HoldHeight, Stick
from mavlink_sitl.autopilot.ardupilot.plane.plane_auto import GlideAuto
from mavlink_sitl.autopilot.ardupilot.plane.plane_modes import (
    Circle,
    Guided,
    Loiter,
    PlaneMode,
    ReturnToLaunch,
)
from mavlink_sitl.autopilot.ardupilot.plane.plane_safety import PlaneFailsafes, PlaneFence
from mavlink_sitl.autopilot.ardupilot.plane.plane_takeoff import TakeOff
from mavlink_sitl.autopilot.common.commander import Commander, PowerUp
from mavlink_sitl.autopilot.common.firmware import Firmware, Inputs, Landing
from mavlink_sitl.autopilot.plans.plans import MissionState, PlanItem
from mavlink_sitl.autopilot.safety.arming import Arming
from mavlink_sitl.autopilot.safety.rally import nearest_rally_ned_m
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.navigation import LEAST_LIMIT, Navigator
from mavlink_sitl.autopilot.state.setpoint import Setpoint
from mavlink_sitl.exchange import (
    Limits,
    Motion,
    NavigationReport,
    Observation,
    Result,
    Severity,
    Vector,
)
from mavlink_sitl.guidance import GlideGuidance

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


MODE_MANUAL, MODE_AUTO, MODE_RTL, MODE_LOITER, MODE_GUIDED = 0, 10, 11, 12, 15
FLYING_M_S = 4.0
STANDING_M_S = 3.0
STEP_S = 0.05


def _landed_by_speed(landing: Landing, inputs: Inputs) -> Landing:
    """In the air when armed and fast, landed when it stands."""
    observation = inputs.observation
    speed_m_s = observation.motion.speed_m_s
    if inputs.armed and speed_m_s > FLYING_M_S:
        return landing.become(False, observation.time_s)
    stands = observation.touching_ground and speed_m_s < STANDING_M_S
    return landing.become(True, observation.time_s) if stands else landing


class Plane(Commander):
    """An aeroplane from power-up to the next. Arguments and attributes as of `Copter`.

    Attributes:
        true_over_indicated: true airspeed over indicated.
        step_s: between two updates.
    """

    navigator: PlaneNavigator
    fence: PlaneFence
    table = Firmware(
        modes={
            "stick": Stick,
            "hold_height": HoldHeight,
            "cruise": Cruise,
            "circle": Circle,
            "loiter": Loiter,
            "rtl": ReturnToLaunch,
            "takeoff": TakeOff,
            "guided": Guided,
            "auto": GlideAuto,
        },
        navigator=PlaneNavigator,
        arming=PlaneArming,
        failsafes=PlaneFailsafes,
        fence=PlaneFence,
        landing=_landed_by_speed,
        reports_start=True,
    )
    true_over_indicated = 1.06
    step_s = STEP_S

    def __init__(self, start: PowerUp) -> None:
        self.airspeed_m_s = 0.0
        super().__init__(start)

    # State.

    def observe(self, observation: Observation) -> None:
        """See `Commander`; takes the airspeed."""
        super().observe(observation)
        self.airspeed_m_s = observation.indicated_m_s(self.true_over_indicated)

    @property
    def aloft(self) -> bool:
        """While it flies, armed or not."""
        return not self.landed

    def sticks(self) -> Vector:
        """Roll and pitch, -1..1, pitch up; throttle, 0..1."""
        radio, now_s = self.radio, self.now_s
        if not radio.heard(now_s):
            return 0.0, 0.0, 0.0
        roll, pitch = radio.angle("Roll", now_s), radio.angle("Pitch", now_s)
        return roll, pitch, radio.throttle(now_s)

    def navigation_report(self) -> NavigationReport | None:
        """For NAV_CONTROLLER_OUTPUT; None in MANUAL."""
        if self.mode.spec.number == MODE_MANUAL:
            return None
        target = self.destination_ned_m()
        if target is None or not isinstance(self.wanted, GlideGuidance):
            return NavigationReport()
        m = self.motion
        north, east = target[0] - m.north_m, target[1] - m.east_m
        bearing = math.degrees(math.atan2(east, north))
        assert isinstance(self.mode, PlaneMode)
        return NavigationReport(
            roll_deg=math.degrees(self.wanted.bank_rad),
            pitch_deg=math.degrees(m.pitch_rad),
            bearing_deg=bearing,
            target_bearing_deg=bearing,
            distance_m=math.hypot(north, east),
            altitude_error_m=m.down_m - target[2],
            airspeed_error_m_s=self.navigator.cruise_m_s() - self.airspeed_m_s,
            cross_track_m=self.mode.cross_track_m,
        )

    def destination_ned_m(self) -> Vector | None:
        """The point it circles or flies to, for POSITION_TARGET_GLOBAL_INT."""
        return self.mode.target if isinstance(self.mode, PlaneMode) else None

    def return_point_ned_m(self) -> Vector:
        """The point that RTL circles: a rally point, or home and RTL_ALTITUDE above it."""
        rally = nearest_rally_ned_m(self)
        if rally is not None:
            return rally
        north, east, down = self.navigator.home_ned_m()
        height = self.parameters["RTL_ALTITUDE"]
        return north, east, self.motion.down_m if height < 0.0 else down - height

    # Requests by people.

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        if self.armed and number != self.mode.spec.number and self.fence.locks_mode:
            name = self.personality.modes[number].name
            self.say(Severity.NOTICE, f"Mode change to {name} denied, in fence recovery")
            return False
        return super().enter_mode(number)

    def may_begin(self, mode: Mode) -> bool:
        """See `Commander`: AUTO without a mission returns."""
        return True

    def start_landing(self) -> Result:
        """DO_LAND_START: continue with the mission's nearest landing, if it has one."""
        auto = self.auto
        start = auto.landing_start() if isinstance(auto, GlideAuto) else None
        if start is None:
            self.say(Severity.WARNING, "Unable to start landing sequence")
            return Result.FAILED
        if self.plans.state is MissionState.COMPLETE:
            self.plans.state = MissionState.NOT_STARTED
        self.say(Severity.INFO, "Landing sequence start")
        if self.mode is auto:
            auto.set_current(start)
            return Result.ACCEPTED
        self.plans.current = start
        return self.set_mode(auto.spec.number)

    def go_around(self, height_m: float) -> Result:
        """DO_GO_AROUND: break a landing off."""
        lands = isinstance(self.mode, GlideAuto) and self.mode.go_around(height_m)
        return Result.ACCEPTED if lands else Result.FAILED

    def start_mission(self) -> Result:
        """MISSION_START: AUTO, whatever is in the mission."""
        self.enter_mode(MODE_AUTO)
        return Result.ACCEPTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided):
            self.mode.setpoint(setpoint)

    def go_to(self, setpoint: Setpoint) -> None:
        """A place for GUIDED: circle it."""
        if setpoint.position_m is not None:
            self.reposition(setpoint.position_m, 0.0, False)

    def reposition(self, place: Vector, radius_m: float, against: bool) -> None:
        """DO_REPOSITION, once in GUIDED: circle another point, NED metres.

        Args:
            place: NED metres.
            radius_m: 0 keeps that of the last in this GUIDED, at first WP_LOITER_RAD.
            against: the clock.
        """
        if isinstance(self.mode, Guided):
            self.mode.reposition(place, radius_m, against)

    def fly_at_height_of(self, item: PlanItem) -> Result:
        """See `Commander`."""
        if not isinstance(self.mode, Guided) or not math.isfinite(item.z):
            return Result.FAILED
        self.mode.change_height(self.auto.place_of(item, self.motion[:3])[2])
        return Result.ACCEPTED

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: airspeed (0) or least speed over ground (1), in GUIDED and AUTO."""
        if not isinstance(self.mode, (Guided, GlideAuto)):
            return Result.FAILED
        return Result.ACCEPTED if self.set_speed(kind, speed_m_s) else Result.FAILED

    def set_speed(self, kind: int, speed_m_s: float) -> bool:
        """Another speed, if it makes sense; says so."""
        if not self.navigator.change_speed(kind, speed_m_s):
            return False
        if kind == 1:
            self.say(Severity.INFO, f"Set groundspeed {int(max(speed_m_s, 0.0))}")
        elif speed_m_s != NO_CHANGE:
            self.say(Severity.INFO, f"Set airspeed {int(speed_m_s)} m/s")
        return True
