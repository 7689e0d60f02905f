"""The profile of one firmware and vehicle type, as data."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.mission_items import MissionRules
from mavlink_vehicle.positions.frames import Projection
from mavlink_vehicle.profiles.equipment import EquipmentRules
from mavlink_vehicle.profiles.failsafe_settings import FailsafeSetting


class VehicleKind(enum.Enum):
    """The vehicle type, as far as flying it is concerned."""

    COPTER = "copter"
    ROVER = "rover"
    BOAT = "boat"
    PLANE = "plane"
    OTHER = "other"


class ModePacking(enum.Enum):
    """The encoding of a custom_mode in MAV_CMD_DO_SET_MODE."""

    WHOLE = "param2"
    """ArduPilot."""
    MAIN_AND_SUB = "main mode in param2, sub mode in param3"
    """PX4: custom_mode is main << 16 | sub << 24."""


class TakeoffForm(enum.Enum):
    """The form of the take-off command and the reference of its altitude."""

    NONE = "none"
    """The vehicle has no such command (rover, boat), or the profile doesn't know it."""
    ABOVE_HOME = "above home"
    """MAV_CMD_NAV_TAKEOFF, param7 is metres above home (ArduCopter)."""
    AMSL = "above mean sea level"
    """MAV_CMD_NAV_TAKEOFF, param7 is metres above mean sea level (PX4)."""
    MODE = "mode"
    """A mode takes off, to the height of a parameter of its own (ArduPlane: TKOFF_ALT)."""


class CommandAltitude(enum.Enum):
    """From where the altitude of a command counts."""

    HOME = "home"
    """MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, above home (ArduPilot, which keeps home in flight)."""
    AMSL = "mean sea level"
    """Above mean sea level, whatever the frame says (PX4, which moves home in flight)."""


class SetpointField(enum.Flag):
    """Groups of SET_POSITION_TARGET_LOCAL_NED; each is given whole or not at all."""

    NONE = 0
    POSITION = enum.auto()
    VELOCITY = enum.auto()
    ACCELERATION = enum.auto()
    YAW = enum.auto()
    YAW_RATE = enum.auto()


@dataclass(frozen=True)
class SpeedCommand:
    """The support for MAV_CMD_DO_CHANGE_SPEED.

    Attributes:
        speed_type: its param1; 0 airspeed, 1 ground speed.
        modes: in which it has an effect.
    """

    speed_type: int
    modes: frozenset[str]


@dataclass(frozen=True)
class FollowingLimits:
    """The limits by which an autopilot comes to a setpoint whose target it moves on by itself.

    Each is the name of a parameter, what makes m/s² or m/s³ of it, and its default in those.

    Attributes:
        acceleration: over ground.
        jerk: over ground.
        climb_acceleration: up and down.
        climb_jerk: up and down.
    """

    acceleration: tuple[str, float, float]
    jerk: tuple[str, float, float]
    climb_acceleration: tuple[str, float, float]
    climb_jerk: tuple[str, float, float]

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names."""
        limits = (self.acceleration, self.jerk, self.climb_acceleration, self.climb_jerk)
        return tuple(name for name, _, _ in limits)


@dataclass(frozen=True)
class SetpointRules:
    """The rules of a firmware for setpoints.

    Attributes:
        motions: the combinations of POSITION, VELOCITY and ACCELERATION that the
            vehicle follows; others it ignores without a word.
        form: what is streamed; what else a setpoint gives is left out.
        prestream_s: how long setpoints must have been streamed before the control mode is
            entered; 0: not before, but after.
        lost_s: how long setpoints may be missing before the firmware takes control away;
            None: it does not.
        outside_control_mode: whether the stream must run before the control mode is
            entered (PX4), or must not (whoever selects that mode later would set it off).
        before_takeoff: whether setpoints may run before and during a take-off. An
            ArduCopter then stays on the ground, although it acknowledges the take-off.
        while_disarmed: whether setpoints may be sent to a disarmed vehicle. A rover
            keeps such a setpoint and drives off when it is armed.
        drives_by_turn_rate: whether it follows a velocity along its own axes with a yaw rate, also
            backwards.
        acceleration_is_push: whether a setpoint's acceleration is a push of the motors, from which
            the drag takes its part, not the acceleration that is to come of it.
        timeout_s: for how long it continues with the velocity and the acceleration of the
            last setpoint when none follows, by the default of its parameter.
        timeout_parameter: the parameter that says so; empty if there is none.
        loss_parameter: the parameter that says what it does after that time, where it may
            drive back; empty if it stops.
        loss_stops: values of that parameter by which it stops.
        following: how it comes to a setpoint whose target it moves on by the last velocity and
            acceleration in that time; None if it does not move the target.
    """

    motions: frozenset[SetpointField] = frozenset()
    form: SetpointField = SetpointField.NONE
    prestream_s: float = 0.0
    lost_s: float | None = None
    outside_control_mode: bool = False
    before_takeoff: bool = False
    while_disarmed: bool = False
    drives_by_turn_rate: bool = False
    acceleration_is_push: bool = False
    timeout_s: float = 0.0
    timeout_parameter: str = ""
    loss_parameter: str = ""
    loss_stops: frozenset[int] = frozenset()
    following: FollowingLimits | None = None


@dataclass(frozen=True)
class TakeoffRules:
    """The rules of a firmware for take-offs.

    Attributes:
        form: how a take-off is asked for.
        mode: the mode that a take-off goes through, if it has one.
        mode_after: the mode that it goes to by itself then.
        control_first: whether the control mode must be entered before a take-off.
    """

    form: TakeoffForm = TakeoffForm.NONE
    mode: str | None = None
    mode_after: str | None = None
    control_first: bool = False


@dataclass(frozen=True)
class LandingTargetRules:
    """The rules of a firmware for landings on a target.

    Attributes:
        mode: the mode that lands on it.
        frame: MAV_FRAME of the position in LANDING_TARGET; MAV_FRAME_BODY_FRD or _LOCAL_NED.
        needed: parameters without whose values the message is ignored.
    """

    mode: str
    frame: int
    needed: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    def to_set(self, known: Mapping[str, float]) -> str:
        """Return which of `needed` are to be set, "NAME to 1 and NAME to 1"; empty if none is.

        Args:
            known: parameters that the vehicle has reported; one that it has not is to be set.
        """
        lacking = (name for name, value in self.needed.items() if known.get(name) != value)
        return " and ".join(f"{name} to {self.needed[name]:g}" for name in lacking)


@dataclass(frozen=True)
class MessageProperties:
    """The properties of what a firmware sends and expects.

    Attributes:
        unsupported: telemetry that the firmware does not have, so isn't asked for.
        own_rates_hz: messages that the firmware sends no more often than this, whatever is asked
            for.
        link_rate_parameter: the parameter that limits what it sends on a link; None: the baud
            rate alone does.
        heartbeat_type: as which MAV_TYPE our HEARTBEAT goes out.
        later_ack_counts: commands with a first acknowledgement that says nothing.
    """

    unsupported: frozenset[str] = frozenset()
    own_rates_hz: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    link_rate_parameter: str | None = None
    heartbeat_type: int = mavlink.MAV_TYPE_ONBOARD_CONTROLLER
    later_ack_counts: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Profile:
    """One firmware and kind of vehicle.

    Attributes:
        name: for people, for example "ArduCopter".
        kind: what it is.
        projection: how its local frame lies over the earth; None: that is not known.
        unsupported: why goals are not accepted on it, as a sentence; None when they are.
        modes: custom_mode by mode name.
        former_modes: the same of modes that only older firmwares have, to name them in logs.
        mode_packing: how a mode goes into the command that changes it.
        control_mode: the mode in which it is flown by us; None: this profile can't.
        arming_mode: the mode that is entered first when the one that it is in is not armed in.
        not_armed_in: modes in which it cannot be armed, and those in which arming would set it
            off, so that it is never armed in them.
        hold_mode: the mode that stops and holds by itself, without a pilot's sticks. A plane
            circles.
        land_mode: lands where it is.
        landing_target: how it lands on a target; None: it does not.
        return_mode: returns to its launch point.
        mission_mode: flies the stored mission.
        missions: what it does with missions; None: that is not known.
        takeoff: how it takes off.
        altitude_reference: of the altitudes in commands.
        reposition: whether it is sent to places by MAV_CMD_DO_REPOSITION, not by setpoints.
        reposition_keeps_mode: whether it takes that command in its control mode without the flag
            that changes the mode, and rejects it in others: so no mode is taken from a pilot.
        circles_by_orbit: whether only MAV_CMD_DO_ORBIT gives it the radius of the circle there;
            else MAV_CMD_DO_REPOSITION does, and a radius stays until another is given.
        sinks_along_leg: whether it descends to such a place gradually on its way there.
        circle_radius_m: of a plane's circles, by the default of its parameter.
        circle_parameters: that parameter; negative is against the clock.
        return_circle_parameters: the parameters of the circle about the launch point; the first
            that is not 0 counts.
        roll_limit_parameter: that of the greatest bank, in degrees.
        airspeed_limit_parameters: those of the least and the greatest airspeed, in m/s; empty where
            there are none.
        return_speeds: the parameters of the speed of its own return, each with what makes m/s of
            it; the first that is above 0 counts.
        return_height: the parameter of the height above home of its own return, with what makes
            metres of it; None: that is not known.
        setpoints: what it does with setpoints.
        speed_command: how its speed is changed by command; None where the setpoints say it.
        status_shows_runnable: whether HEARTBEAT's system_status is 0 while the selected mode
            cannot run.
        pauses_in_mode: whether MAV_CMD_DO_PAUSE_CONTINUE makes it stand in the control mode, and
            ignore setpoints until it is commanded to continue or has been in another mode.
        earlier_mode_after_landing: whether it goes back, by itself, to the mode from before
            when it has landed.
        messages: the messages that it sends and expects.
        wanted_parameters: parameters that are read and kept up to date.
        renamed_parameters: by the names that are used here, those of newer releases, each with what
            makes the unit here of its value.
        equipment: its commands for cameras, gimbals, grippers and outputs.
        traffic_receiver_parameter: the one that is 0 without an ADS-B receiver; None where there
            is none, and what a receiver reports is passed on.
        failsafe_settings: what says how it reacts to failures; read by `navigation_server --check`.
        parameters_bytewise: whether integer parameters stand in the float as their bytes.
    """

    name: str
    kind: VehicleKind = VehicleKind.OTHER
    projection: Projection | None = None
    unsupported: str | None = None
    modes: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    former_modes: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    mode_packing: ModePacking = ModePacking.WHOLE
    control_mode: str | None = None
    arming_mode: str | None = None
    not_armed_in: frozenset[str] = frozenset()
    hold_mode: str | None = None
    land_mode: str | None = None
    landing_target: LandingTargetRules | None = None
    return_mode: str | None = None
    mission_mode: str | None = None
    missions: MissionRules | None = None
    takeoff: TakeoffRules = TakeoffRules()
    altitude_reference: CommandAltitude = CommandAltitude.HOME
    reposition: bool = False
    reposition_keeps_mode: bool = False
    circles_by_orbit: bool = False
    sinks_along_leg: bool = False
    circle_radius_m: float = 0.0
    circle_parameters: tuple[str, ...] = ()
    return_circle_parameters: tuple[str, ...] = ()
    roll_limit_parameter: str = ""
    airspeed_limit_parameters: tuple[str, ...] = ()
    return_speeds: tuple[tuple[str, float], ...] = ()
    return_height: tuple[str, float] | None = None
    setpoints: SetpointRules = SetpointRules()
    speed_command: SpeedCommand | None = None
    status_shows_runnable: bool = False
    pauses_in_mode: bool = False
    earlier_mode_after_landing: bool = False
    messages: MessageProperties = MessageProperties()
    wanted_parameters: tuple[str, ...] = ()
    renamed_parameters: Mapping[str, tuple[str, float]] = field(
        default_factory=lambda: MappingProxyType({})
    )
    equipment: EquipmentRules = field(default_factory=EquipmentRules)
    traffic_receiver_parameter: str | None = None
    failsafe_settings: tuple[FailsafeSetting, ...] = ()
    parameters_bytewise: bool = False

    def mode_name(self, custom_mode: int) -> str:
        """Return the name of a mode, or "MODE_<number>" for one that the profile lacks."""
        for name, number in (*self.modes.items(), *self.former_modes.items()):
            if number == custom_mode:
                return name
        return f"MODE_{custom_mode}"

    @cached_property
    def control_number(self) -> int | None:
        """The custom_mode of the `control_mode`; None without one."""
        return self.mode_number(self.control_mode)

    def mode_number(self, name: str | None) -> int | None:
        """Return the custom_mode of a mode's name, None for no name or an unknown one."""
        return None if name is None else self.modes.get(name)
