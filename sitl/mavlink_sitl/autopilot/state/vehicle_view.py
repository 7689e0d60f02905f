"""The vehicle as the parts of its firmware see it: modes, missions, fence, arming, failsafes."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.autopilot.personality import ModeSpec, Personality
from mavlink_sitl.autopilot.plans.plans import Plans
from mavlink_sitl.autopilot.state.estimator import Estimator
from mavlink_sitl.autopilot.state.navigation import Navigator
from mavlink_sitl.autopilot.state.pilot import Pilot
from mavlink_sitl.autopilot.state.radio import Radio
from mavlink_sitl.exchange import Event, Guidance, Motion, Motors, Result, Severity, Vector
from mavlink_sitl.geodesy import GeoPoint


class ModeView(Protocol):
    """The mode under way."""

    spec: ModeSpec

    @property
    def landing(self) -> bool:
        """Whether it sinks to land."""

    @property
    def wanted_velocity_m_s(self) -> Vector | None:
        """The velocity, NED, that somebody has it fly at."""

    def enter(self) -> None:
        """Take over, or begin again."""

    def ground_motors(self) -> Motors:
        """The permitted motor state while landed."""


class FenceView(Protocol):
    """The fence."""

    def enable(self, on: bool) -> None:
        """Switch it on or off."""

    def reasons(self) -> list[str]:
        """Why it does not let the vehicle arm."""


class FailsafeView(Protocol):
    """What is wrong."""

    def battery_reasons(self) -> list[str]:
        """Why the battery does not let the vehicle arm."""


class OutputsView(Protocol):
    """Servos and relays."""

    def set_relay(self, number: int, state: int) -> Result:
        """DO_SET_RELAY."""

    def repeat_relay(self, number: int, times: int, cycle_s: float) -> Result:
        """DO_REPEAT_RELAY."""

    def repeat_servo(self, output: int, pulse_us: float, times: int, cycle_s: float) -> Result:
        """DO_REPEAT_SERVO."""


class CompassesView(Protocol):
    """The compasses."""

    def reasons(self) -> list[str]:
        """Why they do not let the vehicle arm."""


class ArmingView(Protocol):
    """Whether the motors are armed."""

    armed_at_s: float


class VehicleView(Protocol):
    """One vehicle; the members are those of `firmware.Firmware` and `commander.Commander`."""

    personality: Personality
    parameters: Parameters
    estimator: Estimator
    pilot: Pilot
    radio: Radio
    plans: Plans
    events: deque[Event]
    started: bool
    boot_s: float
    damage: str | None
    motors_stopped: bool

    @property
    def outputs(self) -> OutputsView:
        """Servos and relays."""

    @property
    def compasses(self) -> CompassesView:
        """The compasses."""

    @property
    def navigator(self) -> Navigator:
        """Origin, home and limits."""

    @property
    def mode(self) -> ModeView:
        """The flight mode."""

    @property
    def fence(self) -> FenceView:
        """The fence."""

    @property
    def failsafe(self) -> FailsafeView:
        """What is wrong."""

    @property
    def arming(self) -> ArmingView:
        """Whether the motors are armed, and since when."""

    @property
    def now_s(self) -> float:
        """Simulated time of the latest observation."""

    @property
    def motion(self) -> Motion:
        """The estimated motion."""

    @property
    def armed(self) -> bool:
        """Whether the motors are armed."""

    @property
    def soft_armed(self) -> bool:
        """The armed state in HEARTBEAT."""

    @property
    def landed(self) -> bool:
        """Whether it believes to stand on the ground."""

    @property
    def has_mission(self) -> bool:
        """Whether there is a mission to fly."""

    @property
    def may_arm_in_mode(self) -> bool:
        """Whether motors may be armed in this mode."""

    @property
    def wanted(self) -> Guidance:
        """The last guidance of its mode."""

    def said_at_boot(self, text: str) -> bool:
        """Whether a line of the start has its time behind it."""

    def pilot_throttle(self) -> float:
        """The throttle stick, 0..1."""

    def moving_target(self) -> Vector:
        """Where the controllers' moving target is, NED."""

    def say(self, severity: Severity, text: str) -> None:
        """Words for people."""

    def guide(self, guidance: Guidance) -> None:
        """What the controllers are to do."""

    def enter_mode(self, number: int) -> bool:
        """Change the mode if it may be entered."""

    def choose_mode(self, number: int) -> None:
        """The pilot's switch asks for a mode."""

    def arm_by_stick(self) -> Result:
        """The pilot arms the motors."""

    def enter_first(self, numbers: tuple[int, ...]) -> None:
        """Change to the first of some modes that may be entered."""

    def disarm(self, force: bool = False) -> Result:
        """Disarm the motors; in the air only when forced."""

    def set_home(self, point: GeoPoint | None = None) -> None:
        """Home is there, or here."""

    def set_servo(self, output: int, pulse_us: float) -> Result:
        """DO_SET_SERVO."""

    def aux_function(self, function: int, position: int) -> bool:
        """DO_AUX_FUNCTION."""

    def reboot(self) -> Result:
        """Start again."""

    def land_after_pause(self) -> None:
        """In LAND: stay for a while before sinking."""
