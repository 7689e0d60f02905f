"""Take-off: its command, and the signs of its end."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import LandedState, OperationKind
from mavlink_vehicle.profiles import Profile, TakeoffForm, VehicleKind
from mavlink_vehicle.protocols.operations.command import CommandRequest
from mavlink_vehicle.protocols.operations.operation_goals import StateGoal, mode_request
from mavlink_vehicle.state.reducer import VehicleState

# The vehicle is at its height within this share of it and this distance, once its climb is slower
# than this.
_REACHED_SHARE = 0.95
_REACHED_WITHIN_M = 0.3
_CLIMB_ENDED_M_S = 0.5
# A take-off has begun once the vehicle is this much higher than before.
_ROSE_MIN_M = 0.3
_MODE_BELOW_M = 1.5
"""PX4 calls a take-off over within 0.8 m of its height (NAV_MC_ALT_RAD); planes, 10 m below."""
_LOW_MODE_BELOW_M = 1.0
"""Of a low take-off: the same 0.8 m, and what a position lags behind."""
_PLANE_MODE_BELOW_M = 15.0
_PLANE_LEVEL_ABOVE_M = 15.0
"""A plane that climbs no more above this has reached the height that its own parameter says."""


@dataclass(frozen=True)
class TakeoffGoal(StateGoal):
    """The vehicle is in the air, near the height, and no longer climbing fast.

    Heights count from where it stood: home may be above or below that, and may be moved in flight.
    A plane need not be slow, as it circles on anyway.
    """

    height_m: float
    at_start: VehicleState
    profile: Profile
    kind = OperationKind.TAKE_OFF

    @property
    def wish(self) -> str:
        """The height."""
        return f"to {self.height_m:.1f} m above the ground"

    @property
    def request(self) -> CommandRequest:
        """MAV_CMD_NAV_TAKEOFF, or the mode that takes off."""
        profile = self.profile
        if profile.takeoff.form is TakeoffForm.MODE:
            return mode_request(profile, profile.mode_number(profile.takeoff.mode) or 0)
        standing = self.at_start.global_position
        above_home_m = 0.0 if standing is None else standing.relative_altitude_m
        params = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, above_home_m + self.height_m)
        if profile.takeoff.form is TakeoffForm.AMSL:
            ground_m = ground_altitude_amsl_m(self.at_start) or 0.0
            # Without a place it rises where it is (navigator_main.cpp); zeros would be one.
            params = (0.0, 0.0, 0.0, math.nan, math.nan, math.nan, ground_m + self.height_m)
        return CommandRequest(mavlink.MAV_CMD_NAV_TAKEOFF, params)

    def reached(self, state: VehicleState) -> bool:
        """Return whether it flies at the height; ArduPilot says TAKEOFF until it is done."""
        height_m = self._height_m(state)
        position = state.global_position
        if height_m is None or position is None or not state.armed:
            return False
        if state.landed_state is LandedState.ON_GROUND:
            return False
        enough_m = min(_REACHED_SHARE * self.height_m, self.height_m - _REACHED_WITHIN_M)
        slow = abs(position.velocity_ned_m_s[2]) < _CLIMB_ENDED_M_S
        over = state.custom_mode == self.profile.mode_number(self.profile.takeoff.mode_after)
        if over and self.expects_mode(state) and slow:
            return True
        if self.profile.kind is VehicleKind.PLANE:
            return height_m >= enough_m or (slow and height_m >= _PLANE_LEVEL_ABOVE_M)
        if state.landed_state not in (LandedState.IN_AIR, LandedState.UNDEFINED):
            return False
        return height_m >= enough_m and slow

    def under_way(self, state: VehicleState) -> bool:
        """Return whether it has begun to rise."""
        if state.landed_state is LandedState.TAKEOFF:
            return True
        before_m, height_m = self._height_m(self.at_start), self._height_m(state)
        return before_m is not None and height_m is not None and height_m > before_m + _ROSE_MIN_M

    def failure(self, state: VehicleState) -> str | None:
        """Disarmed again: a vehicle that does not leave the ground does so after 10 s."""
        if self.at_start.armed and not state.armed:
            return "the autopilot disarmed the motors"
        return None

    def expects_mode(self, state: VehicleState) -> bool:
        """Return whether it is the mode that takes off, or the one after it near the height."""
        profile, mode = self.profile, state.custom_mode
        if mode == profile.mode_number(profile.takeoff.mode):
            return True
        height_m = self._height_m(state)
        over_m = _PLANE_MODE_BELOW_M if profile.kind is VehicleKind.PLANE else _MODE_BELOW_M
        over_m = min(over_m, max(0.5 * self.height_m, _LOW_MODE_BELOW_M))
        return (
            mode == profile.mode_number(profile.takeoff.mode_after)
            and height_m is not None
            and height_m >= self.height_m - over_m
        )

    def cut_short(self, state: VehicleState, requested: bool) -> bool:
        """Return whether the mode has nothing to do with a take-off; it is not begun again."""
        return not self.expects_mode(state)

    def next_modes(self, state: VehicleState) -> tuple[int, ...]:
        """Return the mode that it still has to go to by itself."""
        mode = self.profile.mode_number(self.profile.takeoff.mode_after)
        return () if mode in (None, state.custom_mode) else (mode,)

    def _height_m(self, state: VehicleState) -> float | None:
        """Return the height above the ground that it stood on."""
        position = state.global_position
        ground_down_m, local = self.at_start.ground_down_m, state.local_position
        if ground_down_m is not None and local is not None:
            return ground_down_m - local.position_ned_m[2]
        ground_m = ground_altitude_amsl_m(self.at_start)
        return None if position is None or ground_m is None else position.altitude_amsl_m - ground_m


def ground_altitude_amsl_m(state: VehicleState) -> float | None:
    """Return where it last stood on the ground; before that, where it is or where home is."""
    if state.ground_altitude_amsl_m is not None:
        return state.ground_altitude_amsl_m
    if state.global_position is not None:
        return state.global_position.altitude_amsl_m
    return None if state.home is None else state.home.altitude_amsl_m


def takeoff_timeout_s(height_m: float) -> float:
    """Return a patient time for a climb: spin-up, then half a metre a second."""
    return 15.0 + height_m / 0.5


def takeoff_problem(height_m: float, state: VehicleState, profile: Profile) -> str | None:
    """Return why a take-off can't even be asked for, None when it can."""
    if not (math.isfinite(height_m) and height_m > 0.0):
        return f"a height of {height_m} m is not above the ground"
    if profile.takeoff.form is TakeoffForm.NONE:
        return f"{profile.name} has no take-off command"
    if profile.takeoff.form is TakeoffForm.AMSL and ground_altitude_amsl_m(state) is None:
        return "its altitude above sea level is not known yet"
    if profile.takeoff.form is not TakeoffForm.ABOVE_HOME and not state.armed:
        # PX4 acknowledges it, selects the mode and stays where it is.
        return f"{profile.name} is disarmed; arm it first"
    return None
