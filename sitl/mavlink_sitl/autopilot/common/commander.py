"""A firmware that runs in a vehicle: what people command, and whether it may be.

It gets observations (`update`, at a fixed rate) and requests by people (the command methods, at
any time in between). It answers with `guidance` for the controllers and with `events` for the
outside. It reads no clock and knows no MAVLink.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections import deque
from dataclasses import dataclass, replace
from typing import ClassVar, Protocol, TypeVar

from mavlink_sitl.autopilot.common.auto import Auto
from mavlink_sitl.autopilot.common.firmware import Firmware, Inputs, State, step
from mavlink_sitl.autopilot.common.switches import Switches
from mavlink_sitl.autopilot.devices.outputs import Outputs
from mavlink_sitl.autopilot.devices.payload import Payload
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import Personality
from mavlink_sitl.autopilot.plans.plans import PlanItem, Plans
from mavlink_sitl.autopilot.safety.fence import Fence
from mavlink_sitl.autopilot.safety.saved_parameters import Saved
from mavlink_sitl.autopilot.state.estimator import Estimator, ExternalEstimator
from mavlink_sitl.autopilot.state.mode import Mode
from mavlink_sitl.autopilot.state.navigation import Navigator
from mavlink_sitl.autopilot.state.pilot import Pilot
from mavlink_sitl.autopilot.state.radio import Radio
from mavlink_sitl.autopilot.state.setpoint import Setpoint, SetpointFrame
from mavlink_sitl.exchange import (
    Event,
    FurtherBattery,
    GpsReading,
    Guidance,
    HomeChanged,
    LandedState,
    ModeChanged,
    Motion,
    Motors,
    Observation,
    RangeReading,
    RebootRequested,
    Result,
    Severity,
    StatusText,
    SystemStatus,
    Vector,
)
from mavlink_sitl.geodesy import GeoPoint, LocalFrame

M = TypeVar("M", bound=Mode)


class Body(Protocol):
    """The vehicle that a firmware and its messages belong to, as far as they reach it.

    Attributes:
        damage: why it will not fly again; None when it is whole.
    """

    damage: str | None

    @property
    def wind_ned_m_s(self) -> Vector:
        """The wind where it is."""

    def gps_reading(self) -> GpsReading | None:
        """The reading of the receiver; None before it is found."""

    def truth(self) -> Motion:
        """The true position of the vehicle."""

    def truth_point(self) -> GeoPoint:
        """The same on earth."""

    def servos_us(self) -> tuple[int, ...]:
        """Servo outputs of vehicles other than those with four equal motors."""

    def next_battery(self) -> FurtherBattery | None:
        """The battery to report next in BATTERY_STATUS; None for the first one."""

    def measure_ranges(self) -> RangeReading | None:
        """The range sensors; None when there are none."""

    def moving_target(self) -> Vector:
        """Where the controllers' moving target is, NED metres."""

    def inject_failure(self, unit: int, kind: int, instance: int) -> Result:
        """Break something: FAILURE_UNIT, FAILURE_TYPE, and which one, from 1; 0 for all."""

    def take_external_position(self, position_ned_m: Vector, reset: bool) -> None:
        """Take a position from outside, and whether its source was reset."""


@dataclass(frozen=True)
class PowerUp:
    """The inputs of a firmware at its start.

    Attributes:
        personality: the firmware.
        parameters: its parameters; they outlive a reboot.
        plans: its mission, fence and rally points; they do, too.
        body: the vehicle that it runs in.
        origin: where it stands when it starts; becomes the origin of its local frame.
        observation: its first observation, with the time of power-up.
        ready_after_s: how long its estimator takes to use GPS.
        external_position: its estimator takes the position from outside instead.
        photo_camera: a MAVLink camera is beside a PX4.
    """

    personality: Personality
    parameters: Parameters
    plans: Plans
    body: Body
    origin: GeoPoint
    observation: Observation
    ready_after_s: float
    external_position: bool = False
    photo_camera: bool = False


class Commander(ABC):
    """A firmware from power-up to the next; what vehicle type it flies is the subclasses'.

    Attributes:
        table: what the firmware is.
        navigator: origin, home and limits.
        arming: whether the motors are armed.
        estimator: what it knows of its position.
        failsafe: what is wrong.
        pilot: the raw channels of the sticks.
        radio: the sticks as the parameters have them.
        switches: those of the pilot, where the firmware has them.
        state: as of its latest step.
        mode: the flight mode.
        auto: the mode that flies missions, whether it flies or not.
        wanted: the last guidance of its mode.
        guidance: the same as far as motors are allowed to: what the controllers are to do.
        motors_stopped: a switch of the pilot has stopped the motors.
        charge_added_mah: correction of the monitor's count of the charge, by BATTERY_RESET.
        revision: grows with every change of `guidance`.
        events: what happened, for the outside to take away.
    """

    table: ClassVar[Firmware]

    def __init__(self, start: PowerUp) -> None:
        personality, observation = start.personality, start.observation
        self.personality = personality
        self.parameters = start.parameters
        self.plans: Plans = start.plans
        self.body: Body = start.body
        frame = LocalFrame(start.origin, personality.projection)
        self.navigator: Navigator = self.table.navigator(frame, start.parameters)
        self.observation = observation
        self.boot_s = observation.time_s
        estimator = ExternalEstimator if start.external_position else Estimator
        self.estimator: Estimator = estimator(personality, self.boot_s, start.ready_after_s)
        self._battery_ready_at_s = self.estimator.scaled(personality.battery_ready_s)
        self.pilot = Pilot()
        self.radio = Radio(self.pilot, start.parameters)
        self.arming = self.table.arming(self)
        self.saved = Saved(self)
        self.outputs = Outputs(self)
        self.payload = Payload(self)
        self.switches = Switches(self) if "ARMING_RUDDER" in start.parameters else None
        self.motors_stopped = False
        self.charge_added_mah = 0.0
        self.wanted = self.guidance = Guidance()
        self.revision = 0
        self.events: deque[Event] = deque()
        self.state = State(observation.impact_m_s)
        self._modes: dict[int, Mode] = {
            spec.number: self.table.modes[spec.behaviour](self, spec)
            for spec in personality.modes.values()
        }
        self.auto: Auto = self.mode_of(Auto)
        self.mode: Mode = self._modes[self.first_mode()]
        self.fence: Fence = self.table.fence(self)
        self.failsafe = self.table.failsafes(self)
        self.mode.enter()

    # State.

    def first_mode(self) -> int:
        """INITIAL_MODE; soon after the start that of the pilot's switch follows."""
        known = "INITIAL_MODE" in self.parameters
        wanted = int(self.parameters["INITIAL_MODE"]) if known else None
        return wanted if wanted in self._modes else self.table.first_mode

    @property
    def now_s(self) -> float:
        """Simulated time of the latest observation."""
        return self.observation.time_s

    @property
    def motion(self) -> Motion:
        """The estimated motion."""
        return self.observation.motion

    @property
    def started(self) -> bool:
        """Whether it has finished starting."""
        return self.state.started

    @property
    def armed(self) -> bool:
        """Whether the motors are armed."""
        return self.arming.armed

    @property
    def soft_armed(self) -> bool:
        """The armed state in HEARTBEAT."""
        return self.armed

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""
        return self.state.landing.landed

    @property
    def battery_known(self) -> bool:
        """Whether the power monitor has readings yet."""
        return self.now_s >= self._battery_ready_at_s

    @property
    def system_status(self) -> SystemStatus:
        """For HEARTBEAT."""
        if not self.started:
            says_mode = self.personality.boot_mode is not None
            return SystemStatus.CALIBRATING if says_mode else SystemStatus.BOOT
        if self.failsafe.active:
            return SystemStatus.CRITICAL
        return SystemStatus.ACTIVE if self.is_active() else SystemStatus.STANDBY

    def is_active(self) -> bool:
        """Whether it does something."""
        return not self.landed

    @property
    def aloft(self) -> bool:
        """Whether it is off the ground, as EXTENDED_SYS_STATE has it."""
        return self.armed and not self.landed

    @property
    def landed_state(self) -> LandedState:
        """For EXTENDED_SYS_STATE."""
        if not self.aloft:
            return LandedState.ON_GROUND
        if self.mode.taking_off:
            return LandedState.TAKEOFF
        return LandedState.LANDING if self.mode.landing else LandedState.IN_AIR

    # Periodic updates.

    def observe(self, observation: Observation) -> None:
        """Know better where it is, without acting: for commands between two updates."""
        self.observation = observation
        self.navigator.observe(observation.motion, self.estimator.lost)

    def update(self, observation: Observation) -> None:
        """Process the latest state and act; called at a fixed rate."""
        estimator, had_started = self.estimator, self.started
        had_origin = estimator.has_origin
        self.observe(observation)
        estimator.update(observation.time_s, observation.gps_fix, observation.gps_off_m)
        self.state, texts = step(self.table, self.personality, self.state, self._inputs())
        self.events.extend(texts)
        begins = self.started and not had_started
        if begins and not self.table.keeps_early_mode:
            self.enter_mode(self.first_mode())
        if not had_origin and estimator.has_origin:
            self.set_home()
            self.saved.mission_length(max(len(self.plans.mission.items), 1))
        self.watch(observation)
        self.arming.watch()
        self.mode.update()
        if self.arming.disarm_is_due(self.state.landing.since_s):
            self.arming.disarm(force=True)
        self.saved.update()
        self.payload.update()
        self._settle()
        if begins and self.table.reports_start:
            self.events.append(ModeChanged(self.mode.spec.name, False))

    def watch(self, observation: Observation) -> None:
        """Check for failures, and look at the pilot's switches."""
        if self.battery_known:
            self.failsafe.update(observation)
        self.fence.update()
        if self.started and self.switches is not None:
            self.switches.watch()

    def _inputs(self) -> Inputs:
        return Inputs(
            self.observation,
            self.parameters,
            self.armed,
            self.mode.at_rest,
            self.estimator.lost,
            self.estimator.scaled,
            self.navigator.origin.altitude_amsl_m,
        )

    def _settle(self) -> None:
        """Look at the ground again, and give the motors what arming and that allow."""
        landing = self.table.landing(self.state.landing, self._inputs())
        self.state = self.state._replace(landing=landing)
        if self._permitted() is not self.guidance.motors:
            self._publish(replace(self.wanted, restart_xy=True, restart_z=True))

    def _permitted(self) -> Motors:
        """Return the motor state of the mode, limited by arming, emergency stop and ground."""
        if not self.armed or self.motors_stopped:
            return Motors.OFF
        return self.mode.ground_motors() if self.landed else self.wanted.motors

    def guide(self, guidance: Guidance) -> None:
        """Called by modes: what the controllers are to do, as far as motors are allowed to."""
        self.wanted = guidance
        self._publish(guidance)

    def _publish(self, guidance: Guidance) -> None:
        motors = self._permitted()
        self.guidance = guidance if motors is guidance.motors else replace(guidance, motors=motors)
        self.revision += 1

    def say(self, severity: Severity, text: str) -> None:
        """Words for people."""
        self.events.append(StatusText(severity, text))

    def begin_underway(self) -> None:
        """Be armed, and in the air if it flies, as if it had got there by itself."""
        self.arming.armed = True
        self.arming.armed_at_s = self.now_s
        self.state = self.state._replace(landing=self.state.landing.become(False, self.now_s))
        self.hold_underway()
        self._settle()
        if self.switches is not None:
            self.switches.mode.settle()

    def hold_underway(self) -> None:
        """Enter the mode that holds and waits for orders, from where it is: GUIDED."""
        guided = next(m for m in self._modes.values() if m.spec.behaviour == "guided")
        self.change_to(guided)

    def set_home(self, point: GeoPoint | None = None) -> None:
        """Home is there, or here."""
        if point is None:
            self.navigator.set_home()
        else:
            self.navigator.home = point
        self.events.append(HomeChanged())

    # Modes.

    def mode_of(self, kind: type[M]) -> M:
        """The mode of a class, whether it is in force or not."""
        return next(mode for mode in self._modes.values() if isinstance(mode, kind))

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""
        mode = self._modes[number]
        if mode is self.mode:
            return True
        if self.armed:
            reason = None
            if mode.spec.requires_estimate and not self.estimator.position_ok:
                reason = "requires position"
            elif not self.may_begin(mode):
                reason = "init failed"
            if reason is not None:
                text = f"Mode change to {mode.spec.name} failed: {reason}"
                self.say(Severity.WARNING, text)
                return False
        self.change_to(mode)
        return True

    def enter_first(self, numbers: tuple[int, ...]) -> None:
        """Change to the first of some modes that may be entered."""
        for number in numbers:
            if self.mode.spec.number == number or self.enter_mode(number):
                return

    def land_after_pause(self) -> None:
        """In LAND: stay for a while before sinking, where the firmware does."""
        return

    def may_begin(self, mode: Mode) -> bool:
        """Whether a mode has what it begins with; says what is missing."""
        if not isinstance(mode, Auto) or not mode.has_mission:
            return not isinstance(mode, Auto)
        if self.landed and not mode.starts_with_takeoff:
            self.say(Severity.CRITICAL, "Auto: Missing Takeoff Cmd")
            return False
        return True

    def change_to(self, mode: Mode) -> None:
        """Let another mode fly."""
        previous = self.mode
        if isinstance(previous, Auto):
            previous.leave()
        controlled = previous.position_controlled
        self.mode = mode
        self.forget_orders()
        mode.enter()
        self.events.append(ModeChanged(mode.spec.name, controlled))
        self._settle()

    def forget_orders(self) -> None:
        """Forget the speeds that were requested until the next change of mode."""
        self.navigator.forget_speeds()

    def set_mode(self, number: int) -> Result:
        """DO_SET_MODE and SET_MODE."""
        if number not in self._modes:
            self.say(Severity.WARNING, f"No such mode {number}")
            return Result.FAILED
        return Result.ACCEPTED if self.enter_mode(number) else Result.FAILED

    # Requests by people.

    def arm(self, force: bool = False, by: str = "external command") -> Result:
        """Arm the motors, after the checks unless forced; by whom counts."""
        result = self.arming.arm(force, by)
        self._settle()
        return result

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motors; in the air only when forced."""
        result = self.arming.disarm(force)
        self._settle()
        return result

    def stop_motors(self, stop: bool) -> None:
        """The emergency stop: the motors stand at once, and the vehicle stays armed."""
        self.motors_stopped = stop
        self._settle()

    def reboot(self) -> Result:
        """PREFLIGHT_REBOOT_SHUTDOWN: not while armed."""
        if self.armed:
            return Result.FAILED
        self.events.append(RebootRequested())
        return Result.ACCEPTED

    def start_mission(self) -> Result:
        """MISSION_START: AUTO, and no raised throttle needed to take off.

        A mission that is not flown yet is begun twice, by the command and by the mode (read in
        the firmware): its first item is reported twice.
        """
        auto = self.auto
        begins = auto is not self.mode
        if not auto.has_mission or not self.enter_mode(auto.spec.number):
            if not auto.has_mission:
                self.say(Severity.WARNING, f"Mode change to {auto.spec.name} failed: init failed")
            return Result.FAILED
        if begins:
            auto.enter()
        auto.may_take_off = True
        return Result.ACCEPTED

    def save_waypoint(self) -> None:
        """Append this place to the mission, where the firmware can."""
        return

    def fly_to_item(self, item: PlanItem) -> Result:
        """A mission item that is a target for GUIDED: MISSION_ITEM with current = 2."""
        target = self.auto.place_of(item, self.motion[:3])
        guided = self.mode.spec.behaviour == "guided"
        if not guided or not self.armed or not all(map(math.isfinite, target)):
            return Result.FAILED
        self.go_to(Setpoint(SetpointFrame.LOCAL, position_m=target))
        return Result.ACCEPTED

    def fly_at_height_of(self, item: PlanItem) -> Result:
        """MISSION_ITEM with current = 3: another height, for planes in GUIDED."""
        return Result.FAILED

    @abstractmethod
    def setpoint(self, setpoint: Setpoint) -> None:
        """SET_POSITION_TARGET_*: silently ignored in any mode but GUIDED or OFFBOARD."""

    def go_to(self, setpoint: Setpoint) -> None:
        """DO_REPOSITION, once in GUIDED."""
        self.setpoint(setpoint)

    @abstractmethod
    def change_speed(self, kind: int, speed_m_s: float) -> Result:
        """DO_CHANGE_SPEED: 0 and 1 over ground, 2 climbing, 3 sinking."""
