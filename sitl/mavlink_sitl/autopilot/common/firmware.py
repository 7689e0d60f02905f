"""The common base of all firmware: start, state, texts, arming, and guidance of controllers.

It gets observations (`update`, at a fixed rate) and requests by people (the command methods, at
any time in between). It answers with `guidance` for the controllers and with
`events` for the outside. It reads no clock and knows no MAVLink.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from mavlink_sitl.autopilot.common.own_texts import OwnTexts
from mavlink_sitl.autopilot.devices.outputs import Outputs
from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.plans.plans import Plans
from mavlink_sitl.autopilot.safety.arming import Arming
from mavlink_sitl.autopilot.safety.fence import Fence
from mavlink_sitl.autopilot.safety.saved_parameters import Saved
from mavlink_sitl.autopilot.state.estimator import Estimator, ExternalEstimator
from mavlink_sitl.autopilot.state.landing import LandDetector
from mavlink_sitl.autopilot.state.navigation import Navigator
from mavlink_sitl.autopilot.state.pilot import Pilot
from mavlink_sitl.autopilot.state.radio import Radio
from mavlink_sitl.exchange import (
    Event,
    Guidance,
    HomeChanged,
    Motion,
    Motors,
    Observation,
    RebootRequested,
    Result,
    Severity,
    StatusText,
    SystemStatus,
    Vector,
)
from mavlink_sitl.geodesy import GeoPoint, LocalFrame

if TYPE_CHECKING:
    from mavlink_sitl.autopilot.safety.failsafe import Failsafes
    from mavlink_sitl.autopilot.state.mode import Mode


class Body(Protocol):
    """The vehicle that a firmware runs in, as far as it reaches it without guidance.

    Attributes:
        damage: why it will not fly again before it is mended; None when it is whole.
    """

    damage: str | None

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
    """

    personality: Personality
    parameters: Parameters
    plans: Plans
    body: Body
    origin: GeoPoint
    observation: Observation
    ready_after_s: float
    external_position: bool = False


class Firmware(ABC):
    """A firmware from power-up to the next; what vehicle type it flies is the subclasses'.

    Attributes:
        navigator: origin, home and limits.
        arming: whether the motors are armed.
        estimator: what it knows of its position.
        failsafe: what is wrong.
        pilot: the raw channels of the sticks.
        radio: the sticks as the parameters have them.
        started: whether it has finished starting (HEARTBEAT no longer says BOOT).
        mode: the flight mode.
        wanted: the last guidance of its mode.
        guidance: the same as far as motors are allowed to: what the controllers are to do.
        revision: grows with every change of `guidance`.
        events: what happened, for the outside to take away.
    """

    failsafe: Failsafes
    navigator_class: ClassVar[type[Navigator]] = Navigator
    behaviours: ClassVar[Mapping[str, Callable[[Any, ModeSpec], Mode]]] = {}
    """The modes by `ModeSpec.behaviour`"""

    def __init__(self, start: PowerUp) -> None:
        personality, observation = start.personality, start.observation
        self.personality = personality
        self.parameters = start.parameters
        self.plans = start.plans
        self.body = start.body
        frame = LocalFrame(start.origin, personality.projection)
        self.navigator = self.navigator_class(frame, start.parameters)
        self.observation = observation
        self.boot_s = observation.time_s
        estimator = ExternalEstimator if start.external_position else Estimator
        self.estimator: Estimator = estimator(personality, self.boot_s, start.ready_after_s)
        self._battery_ready_at_s = self.estimator.scaled(personality.battery_ready_s)
        self.pilot = Pilot()
        self.radio = Radio(self.pilot, start.parameters)
        self.fence = Fence(self)
        self.arming = Arming(self)
        self.saved = Saved(self)
        self.started = False
        self.outputs = Outputs(self)
        self.motors_stopped = False
        """A switch of the pilot has stopped them; it overrides all else"""
        self.charge_added_mah = 0.0
        """Correction of the monitor's count of the charge, by BATTERY_RESET"""
        self.guidance = Guidance()
        self.revision = 0
        self.events: deque[Event] = deque()
        self._landing = LandDetector()
        self.own_texts = OwnTexts(self, observation)
        self.wanted = Guidance()
        self._modes: dict[int, Mode] = {
            spec.number: self.behaviours[spec.behaviour](self, spec)
            for spec in personality.modes.values()
        }
        self.mode: Mode = self._modes[self.first_mode()]
        self.mode.enter()

    # Differences between firmwares.

    def first_mode(self) -> int:
        """The number of the mode after power-up."""
        return min(self.personality.modes)

    @abstractmethod
    def watch(self, observation: Observation) -> None:
        """Check for failures; called once the power monitor has readings."""

    @abstractmethod
    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered; says why not."""

    def enter_first(self, numbers: tuple[int, ...]) -> None:
        """Change to the first of some modes that may be entered."""
        for number in numbers:
            if self.mode.spec.number == number or self.enter_mode(number):
                return

    def land_after_pause(self) -> None:
        """In LAND: stay for a while before sinking, where the firmware does."""
        return

    @property
    @abstractmethod
    def has_mission(self) -> bool:
        """Whether there is a mission to fly."""

    @property
    @abstractmethod
    def may_arm_in_mode(self) -> bool:
        """Whether motors may be armed in this mode."""

    # State.

    @property
    def now_s(self) -> float:
        """Simulated time of the latest observation."""
        return self.observation.time_s

    @property
    def motion(self) -> Motion:
        """The estimated motion."""
        return self.observation.motion

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
        return self._landing.landed

    @property
    def battery_known(self) -> bool:
        """Whether the power monitor has readings yet."""
        return self.observation.time_s >= self._battery_ready_at_s

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

    def pilot_throttle(self) -> float:
        """The throttle stick, 0..1."""
        return self.radio.range("Throttle", self.now_s)

    # Periodic updates.

    def observe(self, observation: Observation) -> None:
        """Know better where it is, without acting: for commands between two updates."""
        self.observation = observation
        self.navigator.observe(observation.motion, self.estimator.lost)

    def update(self, observation: Observation) -> None:
        """Process the latest state and act; called at a fixed rate."""
        estimator = self.estimator
        had_origin = estimator.has_origin
        self.observe(observation)
        estimator.update(observation.time_s, observation.gps_fix, observation.gps_off_m)
        self.own_texts.update(observation)
        if not self.started and self.now_s >= estimator.scaled(self.personality.standby_s):
            self.started = True
            self.enter_mode(self.first_mode())  # what was chosen too early is forgotten
        if not had_origin and estimator.has_origin:
            self.set_home()
            self.saved.mission_length(max(len(self.plans.mission.items), 1))
        self._landing.update(observation, self.armed)
        self.watch(observation)
        self.arming.watch()
        self.mode.update()
        if self.arming.disarm_is_due(self._landing.landed_since_s):
            self.arming.disarm(force=True)
        self.saved.update()
        self._settle()

    def _settle(self) -> None:
        """Give the motors what arming and the ground allow."""
        if self._permitted_motors() is not self.guidance.motors:
            self._publish(replace(self.wanted, restart_xy=True, restart_z=True))

    def _permitted_motors(self) -> Motors:
        if not self.armed or self.motors_stopped:
            return Motors.OFF
        return self.mode.ground_motors() if self.landed else self.wanted.motors

    def guide(self, guidance: Guidance) -> None:
        """Called by modes: what the controllers are to do, as far as motors are allowed to."""
        self.wanted = guidance
        self._publish(guidance)

    def _publish(self, guidance: Guidance) -> None:
        motors = self._permitted_motors()
        self.guidance = guidance if motors is guidance.motors else replace(guidance, motors=motors)
        self.revision += 1

    def say(self, severity: Severity, text: str) -> None:
        """Words for people."""
        self.events.append(StatusText(severity, text))

    def begin_underway(self) -> None:
        """Be armed, and in the air if it flies, as if it had got there by itself."""
        self.arming.armed = True
        self.arming.armed_at_s = self.now_s
        self._landing.leave()
        self.hold_underway()
        self._settle()

    @abstractmethod
    def hold_underway(self) -> None:
        """Enter the mode that holds and waits for orders, from where it is and as it moves."""

    def set_home(self, point: GeoPoint | None = None) -> None:
        """Home is there, or here."""
        if point is None:
            self.navigator.set_home()
        else:
            self.navigator.home = point
        self.events.append(HomeChanged())

    # Requests by people.

    def arm(self, force: bool = False, by: str = "external command") -> Result:
        """Arm the motors, after the checks unless forced; by whom counts."""
        result = self.arming.arm(force, by)
        self._settle()
        return result

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motors; in the air only when forced."""
        result = self.arming.disarm(force)
        self._landing.update(self.observation, self.armed)
        self._settle()
        return result

    def stop_motors(self, stop: bool) -> None:
        """The emergency stop: the motors stand, and the vehicle stays armed."""
        self.motors_stopped = stop
        self._settle()

    def reboot(self) -> Result:
        """PREFLIGHT_REBOOT_SHUTDOWN: not while armed."""
        if self.armed:
            return Result.FAILED
        self.events.append(RebootRequested())
        return Result.ACCEPTED
