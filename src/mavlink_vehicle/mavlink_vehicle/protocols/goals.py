"""What each operation is to bring about, and by which signs in the vehicle's state it is known."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import LandedState, OperationKind
from mavlink_vehicle.profiles import Profile, TakeoffForm
from mavlink_vehicle.protocols.command import CommandRequest
from mavlink_vehicle.state import VehicleState

FORCE = 21196.0
"""MAV_CMD_COMPONENT_ARM_DISARM param2: disarm even in the air. The vehicle falls."""

_TAKEOFF_PART = 0.95
_TAKEOFF_NEAR_M = 0.3
_TAKEOFF_SLOW_M_S = 0.5
_CLIMBED_M = 0.3


@dataclass(frozen=True)
class ModeGoal:
    """HEARTBEAT shows this mode."""

    name: str
    custom_mode: int
    kind = OperationKind.CHANGE_MODE

    @property
    def wish(self) -> str:
        """The mode's name."""
        return f"to {self.name}"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_SET_MODE with a custom mode."""
        flag = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        return CommandRequest(mavlink.MAV_CMD_DO_SET_MODE, (flag, self.custom_mode))

    def reached(self, state: VehicleState) -> bool:
        """Tell whether the mode is the wanted one."""
        return state.custom_mode == self.custom_mode

    def under_way(self, state: VehicleState) -> bool:
        """A mode change has no middle."""
        return False

    def failure(self, state: VehicleState) -> str | None:
        """Nothing in the state rules it out."""
        return None


@dataclass(frozen=True)
class ArmGoal:
    """HEARTBEAT shows the motors armed (or disarmed)."""

    armed: bool
    force: bool = False

    @property
    def kind(self) -> OperationKind:
        """Arming or disarming."""
        return OperationKind.ARM if self.armed else OperationKind.DISARM

    @property
    def wish(self) -> str:
        """Nothing more to say, unless it is forced."""
        return "by force" if self.force else ""

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_COMPONENT_ARM_DISARM."""
        return CommandRequest(
            mavlink.MAV_CMD_COMPONENT_ARM_DISARM,
            (1.0 if self.armed else 0.0, FORCE if self.force else 0.0),
        )

    def reached(self, state: VehicleState) -> bool:
        """Tell whether the armed flag is the wanted one."""
        return state.armed == self.armed

    def under_way(self, state: VehicleState) -> bool:
        """Arming has no middle that could be seen."""
        return False

    def failure(self, state: VehicleState) -> str | None:
        """Nothing in the state rules it out."""
        return None


@dataclass(frozen=True)
class TakeoffGoal:
    """The vehicle is in the air, near the height, and no longer climbing fast."""

    height_above_home_m: float
    at_start: VehicleState
    profile: Profile
    kind = OperationKind.TAKE_OFF

    @property
    def wish(self) -> str:
        """The height."""
        return f"to {self.height_above_home_m:.1f} m above home"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_NAV_TAKEOFF; param7 by the profile's meaning of height."""
        height_m = self.height_above_home_m
        if self.profile.takeoff is TakeoffForm.AMSL and self.at_start.home is not None:
            height_m += self.at_start.home.altitude_amsl_m
        return CommandRequest(mavlink.MAV_CMD_NAV_TAKEOFF, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m))

    def reached(self, state: VehicleState) -> bool:
        """Tell whether it flies at the height; ArduPilot says TAKEOFF until it is done."""
        position = state.global_position
        if position is None or state.landed_state not in (
            LandedState.IN_AIR,
            LandedState.UNDEFINED,
        ):
            return False
        target_m = self.height_above_home_m
        enough_m = min(_TAKEOFF_PART * target_m, target_m - _TAKEOFF_NEAR_M)
        slow = abs(position.velocity_ned_m_s[2]) < _TAKEOFF_SLOW_M_S
        return position.relative_altitude_m >= enough_m and slow

    def under_way(self, state: VehicleState) -> bool:
        """Tell whether it has begun to rise."""
        if state.landed_state is LandedState.TAKEOFF:
            return True
        before, position = self.at_start.global_position, state.global_position
        return (
            before is not None
            and position is not None
            and position.relative_altitude_m > before.relative_altitude_m + _CLIMBED_M
        )

    def failure(self, state: VehicleState) -> str | None:
        """Disarmed again: an ArduCopter that does not leave the ground does so after 10 s."""
        if self.at_start.armed and not state.armed:
            return "the autopilot disarmed the motors"
        return None


def takeoff_timeout_s(height_above_home_m: float) -> float:
    """Return a patient time for a climb: spin-up, then half a metre a second."""
    return 15.0 + height_above_home_m / 0.5


def takeoff_problem(
    height_above_home_m: float, state: VehicleState, profile: Profile
) -> str | None:
    """Return why a take-off can't even be asked for, None when it can."""
    if not (math.isfinite(height_above_home_m) and height_above_home_m > 0.0):
        return f"a height of {height_above_home_m} m is not above home"
    if profile.takeoff is TakeoffForm.NONE:
        return f"{profile.name} has no take-off command"
    if profile.takeoff is TakeoffForm.AMSL and state.home is None:
        return "the height of home is not known yet"
    return None
