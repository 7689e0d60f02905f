"""What one firmware and kind of vehicle does differently, as data."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType


class TakeoffForm(enum.Enum):
    """How the height of MAV_CMD_NAV_TAKEOFF is meant."""

    NONE = "none"
    """The vehicle has no such command (rover, boat), or the profile doesn't know it."""
    ABOVE_HOME = "above home"
    """COMMAND_LONG, param7 is metres above home (ArduCopter)."""
    AMSL = "above mean sea level"
    """COMMAND_LONG, param7 is metres above mean sea level (PX4)."""


class SetpointField(enum.Flag):
    """Groups of SET_POSITION_TARGET_LOCAL_NED; each is given whole or not at all."""

    NONE = 0
    POSITION = enum.auto()
    VELOCITY = enum.auto()
    ACCELERATION = enum.auto()
    YAW = enum.auto()
    YAW_RATE = enum.auto()


@dataclass(frozen=True)
class Profile:
    """One firmware and kind of vehicle.

    Attributes:
        name: for people, for example "ArduCopter".
        modes: custom_mode by mode name.
        control_mode: the mode in which setpoints are followed; None: this profile can't.
        hold_mode: the mode that stops and holds by itself, without a pilot's sticks.
        land_mode: lands where it is.
        return_mode: returns to its launch point.
        mission_mode: flies the uploaded mission.
        takeoff_mode: the mode that a take-off changes to, if it does not stay in the control
            mode.
        takeoff: how the take-off command is written.
        setpoint_motions: the combinations of POSITION, VELOCITY and ACCELERATION that the
            vehicle follows; others it ignores without a word.
        setpoint_form: what the bridge normally streams.
        setpoints_while_disarmed: whether setpoints may be sent to a disarmed vehicle. A rover
            keeps such a setpoint and drives off when it is armed.
        setpoints_outside_control_mode: whether the stream must run before the control mode is
            entered (PX4), or must not (whoever selects that mode later would set it off).
        setpoints_before_takeoff: whether setpoints may run before and during a take-off. An
            ArduCopter then stays on the ground, although it acknowledges the take-off.
        later_ack_counts: commands with a first acknowledgement that says nothing.
        unsupported_messages: telemetry that the firmware does not have, so isn't asked for.
    """

    name: str
    modes: Mapping[str, int] = field(default_factory=lambda: MappingProxyType({}))
    control_mode: str | None = None
    hold_mode: str | None = None
    land_mode: str | None = None
    return_mode: str | None = None
    mission_mode: str | None = None
    takeoff_mode: str | None = None
    takeoff: TakeoffForm = TakeoffForm.NONE
    setpoint_motions: frozenset[SetpointField] = frozenset()
    setpoint_form: SetpointField = SetpointField.NONE
    setpoints_while_disarmed: bool = False
    setpoints_outside_control_mode: bool = False
    setpoints_before_takeoff: bool = False
    later_ack_counts: frozenset[int] = frozenset()
    unsupported_messages: frozenset[str] = frozenset()

    def mode_name(self, custom_mode: int) -> str:
        """Return the name of a mode, or "MODE_<number>" for one that the profile lacks."""
        for name, number in self.modes.items():
            if number == custom_mode:
                return name
        return f"MODE_{custom_mode}"
