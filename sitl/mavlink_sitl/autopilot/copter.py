"""One copter's firmware: what it may do, what it does by itself, what it says.

It is told what is the case (`update`, at a fixed rate) and what people want (the command
methods, at any time in between). It answers with `guidance` for the controllers and with
`events` for the outside. It reads no clock and knows no MAVLink.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace

from mavlink_sitl.autopilot.arming import Arming
from mavlink_sitl.autopilot.auto import ALLOW_ARMING, Auto
from mavlink_sitl.autopilot.estimator import Estimator
from mavlink_sitl.autopilot.failsafe import Failsafes
from mavlink_sitl.autopilot.fence import Fence
from mavlink_sitl.autopilot.guided import Frame, Guided, Setpoint
from mavlink_sitl.autopilot.landing import LandDetector
from mavlink_sitl.autopilot.modes import Brake, Land, Mode, PilotHeight, Stabilize
from mavlink_sitl.autopilot.navigation import Navigator
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.pilot import Pilot
from mavlink_sitl.autopilot.plans import PlanItem, Plans
from mavlink_sitl.autopilot.rtl import ReturnToLaunch
from mavlink_sitl.exchange import (
    Event,
    Guidance,
    HomeChanged,
    LandedState,
    ModeChanged,
    Motion,
    Motors,
    Observation,
    RebootRequested,
    Result,
    Severity,
    StatusText,
    SystemStatus,
)
from mavlink_sitl.geodesy import GeoPoint

BEHAVIOURS: dict[str, Callable[[Copter, ModeSpec], Mode]] = {
    "stabilize": Stabilize,
    "alt_hold": PilotHeight,
    "auto": Auto,
    "guided": Guided,
    "loiter": PilotHeight,
    "rtl": ReturnToLaunch,
    "land": Land,
    "brake": Brake,
}


class Copter:
    """A copter from power-up to the next.

    Args:
        personality: the firmware.
        parameters: its parameters; they outlive a reboot.
        origin: where it stands when it starts; becomes the origin of its local frame.
        observation: the first thing it is told; its time is that of power-up.
        ready_after_s: how long its estimator takes to use GPS.

    Attributes:
        navigator: origin, home and limits.
        arming: whether the motors are armed.
        estimator: what it knows of its position.
        failsafe: what is wrong.
        pilot: the sticks.
        started: whether it has finished starting (HEARTBEAT no longer says BOOT).
        mode: the flight mode.
        guidance: what the controllers are to do.
        revision: grows with every change of `guidance`.
        events: what happened, for the outside to take away.
    """

    def __init__(
        self,
        personality: Personality,
        parameters: Parameters,
        origin: GeoPoint,
        observation: Observation,
        ready_after_s: float,
    ) -> None:
        """See the class."""
        self.personality = personality
        self.parameters = parameters
        self.navigator = self.make_navigator(origin)
        self.observation = observation
        self.boot_s = observation.time_s
        self.estimator = Estimator(personality, self.boot_s, ready_after_s)
        self.failsafe = Failsafes()
        self.pilot = Pilot()
        self.plans = Plans()
        """Mission, fence and rally points; whoever makes the firmware gives it the stored ones."""
        self.fence = Fence(self)
        self.arming = Arming(self)
        self.started = False
        self.inject_failure: Callable[[int, int, int], Result] = lambda *_: Result.UNSUPPORTED
        """Breaks something; set by whoever runs the vehicle"""
        self.damage: str | None = None
        """Why it will not fly again before it is mended"""
        self.guidance = Guidance()
        self.revision = 0
        self.events: deque[Event] = deque()
        self.moving_target: Callable[[], tuple[float, float, float]] = lambda: (0.0, 0.0, 0.0)
        """Where the controllers' moving target is, NED; set by whoever runs the controllers."""
        self._landing = LandDetector()
        self._said_boot = 0
        self._impact_m_s = observation.impact_m_s
        self._wanted = Guidance()
        self._modes: dict[int, Mode] = {
            spec.number: self.make_mode(spec) for spec in personality.modes.values()
        }
        self.mode: Mode = self._modes[self.first_mode()]
        self.mode.enter()

    # What differs between firmwares.

    def make_navigator(self, origin: GeoPoint) -> Navigator:
        """Origin, home and limits."""
        return Navigator(origin, self.parameters)

    def make_mode(self, spec: ModeSpec) -> Mode:
        """The mode that goes with an entry of the personality."""
        return BEHAVIOURS[spec.behaviour](self, spec)

    def first_mode(self) -> int:
        """The number of the mode after power-up."""
        return min(self.personality.modes)

    def force_battery_voltage(self, voltage_v: float) -> None:
        """Where the firmware simulates its battery itself: a voltage for it, or 0."""

    def watch(self, observation: Observation) -> None:
        """Look for what is wrong; once the power monitor has readings."""
        if self.battery_known:
            self.failsafe.update(self, observation)
        self.fence.update()

    # What it knows.

    @property
    def now_s(self) -> float:
        """Simulated time of the latest observation."""
        return self.observation.time_s

    @property
    def motion(self) -> Motion:
        """Where it believes to be."""
        return self.observation.motion

    @property
    def armed(self) -> bool:
        """Whether the motors are armed."""
        return self.arming.armed

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self._landing.landed

    @property
    def battery_known(self) -> bool:
        """Whether the power monitor has readings yet."""
        return self.now_s >= self.estimator.scaled(self.personality.battery_ready_s)

    @property
    def landed_state(self) -> LandedState:
        """For EXTENDED_SYS_STATE."""
        if not self.armed or self.landed:
            return LandedState.ON_GROUND
        if self.mode.taking_off:
            return LandedState.TAKEOFF
        return LandedState.LANDING if self.mode.landing else LandedState.IN_AIR

    @property
    def system_status(self) -> SystemStatus:
        """For HEARTBEAT."""
        if not self.started:
            return SystemStatus.BOOT
        if self.failsafe.active:
            return SystemStatus.CRITICAL
        return SystemStatus.STANDBY if self.landed else SystemStatus.ACTIVE

    @property
    def guided(self) -> Guided:
        """The GUIDED mode, whether it flies or not."""
        return next(mode for mode in self._modes.values() if isinstance(mode, Guided))

    def pilot_throttle(self) -> float:
        """The throttle stick, 0..1."""
        return self.pilot.throttle(self.now_s, self.parameters["RC_OVERRIDE_TIME"])

    def pilot_climb_rate_m_s(self) -> float:
        """What the throttle stick asks for where height is held; positive is up."""
        p = self.parameters
        up = p["PILOT_SPEED_UP"] / 100.0
        down = (p["PILOT_SPEED_DN"] or p["PILOT_SPEED_UP"]) / 100.0
        return self.pilot.climb_rate_m_s(self.now_s, p["RC_OVERRIDE_TIME"], up, down)

    # What it does by itself.

    def observe(self, observation: Observation) -> None:
        """Know better where it is, without acting: for commands between two updates."""
        self.observation = observation
        self.navigator.observe(observation.motion, self.estimator.lost)

    def update(self, observation: Observation) -> None:
        """Take notice of the world and act; called at a fixed rate."""
        had_origin = self.estimator.has_origin
        self.observe(observation)
        self.estimator.update(observation.time_s, observation.gps_fix)
        self._say_boot()
        if not self.started and self.now_s >= self.estimator.scaled(self.personality.standby_s):
            self.started = True
            self.enter_mode(self.first_mode())  # what was chosen too early is forgotten
        if self.estimator.has_origin and not had_origin:
            self.set_home()
        self._landing.update(observation, self.armed)
        self._feel_ground(observation)
        self.watch(observation)
        self.arming.watch()
        self.mode.update()
        if self.arming.disarm_is_due(self._landing.landed_since_s):
            self.arming.disarm(force=True)
        self._settle()

    def _say_boot(self) -> None:
        steps = self.personality.boot
        while self._said_boot < len(steps):
            step = steps[self._said_boot]
            if self.now_s < self.estimator.scaled(step.at_s):
                return
            self._said_boot += 1
            elevation = self.navigator.origin.altitude_amsl_m
            self.say(Severity.INFO, step.text.format(elevation=elevation))

    def _feel_ground(self, observation: Observation) -> None:
        impact = observation.impact_m_s
        if impact != self._impact_m_s and impact > 0.0:
            self.say(Severity.INFO, f"SIM Hit ground at {impact:.6f} m/s")
        self._impact_m_s = impact

    def _settle(self) -> None:
        """Give the motors what arming and the ground allow."""
        if not self.armed:
            motors = Motors.OFF
        elif self.landed:
            motors = self.mode.ground_motors()
        else:
            motors = self._wanted.motors
        if motors is not self.guidance.motors:
            self._publish(replace(self._wanted, motors=motors, restart_xy=True, restart_z=True))

    def guide(self, guidance: Guidance) -> None:
        """Called by modes: what the controllers are to do, as far as motors are allowed to."""
        self._wanted = guidance
        if not self.armed:
            guidance = replace(guidance, motors=Motors.OFF)
        elif self.landed:
            guidance = replace(guidance, motors=self.mode.ground_motors())
        self._publish(guidance)

    def _publish(self, guidance: Guidance) -> None:
        self.guidance = guidance
        self.revision += 1

    def say(self, severity: Severity, text: str) -> None:
        """Words for people."""
        self.events.append(StatusText(severity, text))

    def set_home(self) -> None:
        """Home is here."""
        self.navigator.set_home()
        self.events.append(HomeChanged())

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        mode = self._modes[number]
        if mode is self.mode:
            return True
        if self.armed:
            reason = None
            if mode.spec.requires_position and not self.estimator.position_ok:
                reason = "requires position"
            elif isinstance(mode, Auto) and not self._may_start_mission(mode):
                reason = "init failed"
            if reason is not None:
                text = f"Mode change to {mode.spec.name} failed: {reason}"
                self.say(Severity.WARNING, text)
                return False
        previous = self.mode
        if isinstance(previous, Auto):
            previous.leave()
        self.mode = mode
        self.navigator.forget_speeds()
        mode.enter()
        self.events.append(ModeChanged(mode.spec.name, previous.spec.position_controlled))
        self._settle()
        return True

    @property
    def auto(self) -> Auto | None:
        """The mode that flies missions, whether it flies or not."""
        return next((mode for mode in self._modes.values() if isinstance(mode, Auto)), None)

    @property
    def has_mission(self) -> bool:
        """Whether there is a mission to fly."""
        return self.auto is not None and self.auto.has_mission

    @property
    def may_arm_in_mode(self) -> bool:
        """Whether motors may be armed in this mode; AUTO_OPTIONS opens AUTO for it."""
        auto = isinstance(self.mode, Auto) and "AUTO_OPTIONS" in self.parameters
        if auto and int(self.parameters["AUTO_OPTIONS"]) & ALLOW_ARMING:
            return True
        return self.mode.spec.armable

    def _may_start_mission(self, auto: Auto) -> bool:
        if not auto.has_mission:
            return False
        if self.landed and not auto.starts_with_takeoff:
            self.say(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
            return False
        return True

    def mission_changed(self) -> None:
        """An item of the mission was replaced, or its end was cut off."""
        if isinstance(self.mode, Auto):
            self.mode.mission_changed()

    def start_mission(self) -> Result:
        """MISSION_START: AUTO, and no raised throttle needed to take off."""
        auto = self.auto
        if auto is None or not auto.has_mission or not self.enter_mode(auto.spec.number):
            if auto is not None and not auto.has_mission:
                self.say(Severity.WARNING, f"Mode change to {auto.spec.name} failed: init failed")
            return Result.FAILED
        auto.may_take_off = True
        return Result.ACCEPTED

    def set_current_item(self, seq: int) -> Result:
        """DO_SET_MISSION_CURRENT and MISSION_SET_CURRENT."""
        if not 0 <= seq < len(self.plans.mission.items):
            return Result.DENIED
        self.plans.current = seq
        if isinstance(self.mode, Auto):
            self.mode.jump_to(max(seq, int(self.personality.plan_rules.home_first)))
        return Result.ACCEPTED

    def fly_to_item(self, item: PlanItem) -> Result:
        """A mission item that is a target for GUIDED: MISSION_ITEM with current = 2."""
        if not isinstance(self.mode, Guided) or self.auto is None or not self.armed:
            return Result.FAILED
        target = self.auto.place_of(item, self.motion[:3])
        if not all(math.isfinite(value) for value in target):
            return Result.FAILED
        self.mode.setpoint(Setpoint(Frame.LOCAL, position_m=target))
        return Result.ACCEPTED

    def pause_or_go_on(self, go_on: bool) -> Result:
        """DO_PAUSE_CONTINUE: AUTO and GUIDED stop and hold, or go on."""
        if isinstance(self.mode, Auto):
            return self.mode.go_on() if go_on else self.mode.pause()
        if not isinstance(self.mode, Guided):
            return Result.FAILED
        if not go_on:
            self.mode.enter()
        return Result.ACCEPTED

    def land_after_pause(self) -> None:
        """In LAND: stay for a while before sinking."""
        if isinstance(self.mode, Land):
            self.mode.pause()

    # What people want of it.

    def set_mode(self, number: int) -> Result:
        """DO_SET_MODE and SET_MODE."""
        if number not in self._modes:
            self.say(Severity.WARNING, f"No such mode {number}")
            return Result.FAILED
        return Result.ACCEPTED if self.enter_mode(number) else Result.FAILED

    def arm(self, force: bool = False) -> Result:
        """Arm the motors, after the checks unless forced."""
        result = self.arming.arm(force)
        self._settle()
        return result

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motors; in the air only when forced."""
        result = self.arming.disarm(force)
        self._landing.update(self.observation, self.armed)
        self._settle()
        return result

    def take_off(self, altitude_above_home_m: float) -> Result:
        """NAV_TAKEOFF: in GUIDED, armed, on the ground, upwards."""
        mode = self.mode
        if not isinstance(mode, Guided) or not self.armed or not self.landed:
            return Result.FAILED
        if not max(self.navigator.height_above_home_m(), 0.0) < altitude_above_home_m:
            return Result.FAILED
        mode.take_off(self.navigator.home_ned_m()[2] - altitude_above_home_m)
        return Result.ACCEPTED

    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED."""
        if isinstance(self.mode, Guided) and not self.fence.blocks(setpoint):
            self.mode.setpoint(setpoint)

    def go_to(self, setpoint: Setpoint) -> None:
        """DO_REPOSITION, once in GUIDED."""
        self.setpoint(setpoint)

    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: 0 and 1 over ground, 2 climbing, 3 sinking; GUIDED only."""
        if not isinstance(self.mode, (Auto, Guided)):
            return Result.FAILED
        if not self.navigator.change_speed(kind, speed_m_s):
            return Result.FAILED
        if isinstance(self.mode, Auto):
            self.mode.limits_changed()
            return Result.ACCEPTED
        north, east, down = self.moving_target()
        changed = replace(
            self._wanted,
            north_m=north,
            east_m=east,
            down_m=down,
            restart_xy=False,
            restart_z=False,
            limits=self.navigator.limits(),
        )
        self.guide(changed)
        return Result.ACCEPTED

    def reboot(self) -> Result:
        """PREFLIGHT_REBOOT_SHUTDOWN: not while armed."""
        if self.armed:
            return Result.FAILED
        self.events.append(RebootRequested())
        return Result.ACCEPTED
