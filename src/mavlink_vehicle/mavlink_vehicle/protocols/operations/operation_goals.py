"""The goal of each operation, and the signs of it in the vehicle's state."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.profiles import CommandAltitude, ModePacking, Profile
from mavlink_vehicle.protocols.operations.command import CommandRequest
from mavlink_vehicle.state.reducer import VehicleState

# ArduPlane counts the metres in 16 bits.
_RADIUS_MAX_M = 65535.0
_TO_A_MODE = (OperationKind.CHANGE_MODE, OperationKind.RESTORE_MODE)
FORCE = 21196.0
"""MAV_CMD_COMPONENT_ARM_DISARM param2: disarm even in the air. The vehicle falls."""


def mode_request(profile: Profile, custom_mode: int) -> CommandRequest:
    """Return MAV_CMD_DO_SET_MODE with a custom mode, packed as the firmware wants it."""
    flag = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    params: tuple[float, ...] = (flag, custom_mode)
    if profile.mode_packing is ModePacking.MAIN_AND_SUB:
        params = (flag, custom_mode >> 16 & 0xFF, custom_mode >> 24 & 0xFF)
    return CommandRequest(mavlink.MAV_CMD_DO_SET_MODE, params)


class StateGoal:
    """The common base of most goals."""

    needs_ack: ClassVar[bool] = False
    """Whether an acknowledgement must come beside the state that shows it."""

    def under_way(self, state: VehicleState) -> bool:
        """It has no middle that could be seen."""
        return False

    def failure(self, state: VehicleState) -> str | None:
        """Nothing in the state rules it out."""
        return None

    def hint(self, state: VehicleState) -> str | None:
        """Nothing in the state says why it isn't there yet."""
        return None

    def expects_mode(self, state: VehicleState) -> bool:
        """It brings no mode with it."""
        return False

    def cut_short(self, state: VehicleState, requested: bool) -> bool:
        """Another mode does not matter to it."""
        return False

    def next_modes(self, state: VehicleState) -> tuple[int, ...]:
        """Nothing follows by itself."""
        return ()


@dataclass(frozen=True)
class ModeGoal(StateGoal):
    """HEARTBEAT shows this mode, and that it can run where the firmware reports that."""

    name: str
    custom_mode: int
    profile: Profile
    kind: OperationKind = OperationKind.CHANGE_MODE

    @property
    def wish(self) -> str:
        """The mode's name."""
        return f"{'to' if self.kind in _TO_A_MODE else 'by'} {self.name}"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_SET_MODE with a custom mode."""
        return mode_request(self.profile, self.custom_mode)

    def reached(self, state: VehicleState) -> bool:
        """Return whether the mode is the wanted one."""
        return self.expects_mode(state) and not self._cannot_run(state)

    def hint(self, state: VehicleState) -> str | None:
        """Report that the mode is shown, but cannot run."""
        if self.expects_mode(state) and self._cannot_run(state):
            return f"{self.name} is selected but cannot run now (system_status 0)"
        return None

    def expects_mode(self, state: VehicleState) -> bool:
        """Return whether the mode is the wanted one."""
        return state.custom_mode == self.custom_mode

    def cut_short(self, state: VehicleState, requested: bool) -> bool:
        """Return whether somebody else chose another mode."""
        return not requested and not self.expects_mode(state)

    def _cannot_run(self, state: VehicleState) -> bool:
        return self.profile.status_shows_runnable and state.mode_may_not_run


@dataclass(frozen=True)
class ArmingModeGoal(ModeGoal):
    """HEARTBEAT shows the mode to arm in; whether it can run there, arming will show."""

    kind: OperationKind = OperationKind.ARM

    @property
    def wish(self) -> str:
        """The mode's name."""
        return f"in {self.name}"

    def reached(self, state: VehicleState) -> bool:
        """Return whether the mode is the wanted one."""
        return self.expects_mode(state)


@dataclass(frozen=True)
class ArmGoal(StateGoal):
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
        """Return whether the armed flag is the wanted one."""
        return state.armed == self.armed


@dataclass(frozen=True)
class RepositionGoal(ModeGoal):
    """It was acknowledged, and HEARTBEAT shows the mode that flies there.

    MAV_CMD_DO_REPOSITION as COMMAND_INT; ArduPilot knows no other form. param2 bit 0 asks for
    the mode: PX4 takes the command only with it. A PX4 plane takes a radius with MAV_CMD_DO_ORBIT.
    """

    latitude_deg: float = 0.0
    longitude_deg: float = 0.0
    altitude_m: float = 0.0
    frame: int = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
    yaw: float = 0.0
    radius_m: float = 0.0
    by_orbit: bool = False
    keeps_mode: bool = False
    kind: OperationKind = OperationKind.REPOSITION
    needs_ack = True

    @property
    def wish(self) -> str:
        """The place."""
        return f"to {self.latitude_deg:.6f}, {self.longitude_deg:.6f}"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_REPOSITION; param1 -1 keeps the speed, param3 0 the radius. Or DO_ORBIT."""
        command = mavlink.MAV_CMD_DO_REPOSITION
        change_mode = 0.0 if self.keeps_mode else float(mavlink.MAV_DO_REPOSITION_FLAGS_CHANGE_MODE)
        how = (-1.0, change_mode, self.radius_m, self.yaw)
        if self.by_orbit:
            command, how = mavlink.MAV_CMD_DO_ORBIT, (self.radius_m, math.nan, 0.0, math.nan)
        place = (round(self.latitude_deg * 1e7), round(self.longitude_deg * 1e7), self.altitude_m)
        return CommandRequest(command, (*how, *place), frame=self.frame)


@dataclass(frozen=True)
class SpeedGoal(StateGoal):
    """MAV_CMD_DO_CHANGE_SPEED was acknowledged: nothing in the state shows it."""

    speed_m_s: float
    speed_type: int
    kind = OperationKind.CHANGE_SPEED
    needs_ack = True

    @property
    def wish(self) -> str:
        """The speed."""
        return f"to {self.speed_m_s:.1f} m/s"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_DO_CHANGE_SPEED; param3 -1 leaves the throttle."""
        return CommandRequest(
            mavlink.MAV_CMD_DO_CHANGE_SPEED, (self.speed_type, self.speed_m_s, -1.0)
        )

    def reached(self, state: VehicleState) -> bool:
        """The acknowledgement is all there is."""
        return True


def speed_problem(speed_m_s: float, mode_name: str, profile: Profile) -> str | None:
    """Return why a speed can't even be asked for, None when it can."""
    if not (math.isfinite(speed_m_s) and speed_m_s > 0.0):
        return f"{speed_m_s} m/s is not a speed"
    command = profile.speed_command
    if command is None:
        return f"{profile.name} has no speed command; its speed is that of the setpoints"
    if mode_name not in command.modes:
        modes = " and ".join(sorted(command.modes))
        return f"{profile.name} is in {mode_name}; the command has an effect in {modes} only"
    return None


def reposition_problem(
    place: tuple[float, float, float],
    radius_m: float | None,
    state: VehicleState,
    profile: Profile,
) -> str | None:
    """Return why it can't even be asked for, None when it can.

    Args:
        place: latitude and longitude in degrees, altitude above mean sea level in metres.
        radius_m: of the circle about it, negative against the clock; None for the usual one.
        state: the vehicle's state.
        profile: its profile.
    """
    latitude_deg, longitude_deg, altitude_m = place
    if not profile.reposition:
        return f"{profile.name} is flown by setpoints"
    if not (abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0 and abs(altitude_m) <= 1e5):
        return f"{latitude_deg}, {longitude_deg}, {altitude_m} m is not a valid position"
    if radius_m is not None and not 1.0 < abs(radius_m) <= _RADIUS_MAX_M:
        return f"{radius_m} m is not a valid circle radius"
    if not state.armed:
        # PX4 acknowledges it, changes the mode and forgets the place.
        return f"{profile.name} is disarmed; arm it first"
    if profile.altitude_reference is CommandAltitude.HOME and state.home is None:
        return "the altitude of home is not known yet"
    return None


def reposition_goal(
    place: tuple[float, float, float],
    radius_m: float | None,
    state: VehicleState,
    profile: Profile,
    usual_m: float = 0.0,
) -> RepositionGoal:
    """Return the goal for a place without a `reposition_problem`; the parameters are the same.

    `usual_m` is the radius by the vehicle's parameter, 0 while that is not known.
    """
    latitude_deg, longitude_deg, altitude_m = place
    frame, yaw = mavlink.MAV_FRAME_GLOBAL_INT, math.nan
    if profile.altitude_reference is CommandAltitude.HOME and state.home is not None:
        altitude_m -= state.home.altitude_amsl_m
        # PX4 takes a yaw here; ArduPlane the direction of the circle, 0 clockwise.
        frame, yaw = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0.0
    by_orbit = profile.circles_by_orbit and radius_m is not None
    if not profile.circles_by_orbit:
        # It would keep the radius of a circle before this one.
        signed_m = usual_m if radius_m is None else radius_m
        radius_m, yaw = abs(signed_m), 1.0 if signed_m < 0.0 else 0.0
    mode = profile.control_mode or ""
    return RepositionGoal(
        mode,
        profile.modes[mode],
        profile,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_m=altitude_m,
        frame=frame,
        yaw=yaw,
        radius_m=radius_m or 0.0,
        by_orbit=by_orbit,
    )
