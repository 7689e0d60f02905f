"""One autopilot and the operations that can be requested of it, without I/O or a clock.

`io.driver` runs a `Vehicle` on real links; a test runs it with a `ManualClock`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import OperationKind
from mavlink_vehicle.missions import Missions
from mavlink_vehicle.profiles import Profile
from mavlink_vehicle.protocols.operation_slot import Wanted
from mavlink_vehicle.protocols.operations.operation_goals import (
    ArmGoal,
    ArmingModeGoal,
    ModeGoal,
    SpeedGoal,
    reposition_goal,
    reposition_problem,
    speed_problem,
)
from mavlink_vehicle.protocols.operations.operation_parts import Gate, OperationTiming
from mavlink_vehicle.protocols.operations.takeoff_goal import (
    TakeoffGoal,
    takeoff_problem,
    takeoff_timeout_s,
)
from mavlink_vehicle.protocols.service import VehicleService
from mavlink_vehicle.protocols.streams.setpoint_stream import SetpointNed
from mavlink_vehicle.storage.requests import Storage
from mavlink_vehicle.vehicle_config import DEFAULT_RATES_HZ, VehicleConfig
from mavlink_vehicle.vehicle_core import VehicleCore

__all__ = ["DEFAULT_RATES_HZ", "SetpointNed", "Vehicle", "VehicleConfig"]

_TAKEOFF_DOUBT_S = 6.0
"""An ArduCopter spins its motors up for 3.5 s before anything shows that it takes off."""


class Vehicle(VehicleCore):
    """One autopilot; sans I/O.

    Operations are asynchronous: each method returns an id, and each operation ends in one
    `OperationFinished` with that id. One runs at a time; a new one cancels the pending one.
    """

    def __init__(
        self, config: VehicleConfig | None = None, further: Iterable[VehicleService] = ()
    ) -> None:
        """Prepare; nothing happens before `start`. `further` services run beside the others."""
        super().__init__(config, further)
        self.missions = Missions(self)
        self.storage = Storage(self)

    # Modes

    def change_mode(self, name: str, now: float) -> int:
        """Change to the mode called `name`; returns the operation's id."""
        profile, kind = self.profile, OperationKind.CHANGE_MODE
        if profile is None:
            return self.operations.nobody(kind, now)
        if name not in profile.modes:
            known = ", ".join(sorted(profile.modes)) or "none known"
            reason = f"{profile.name} has no mode {name!r}; its modes are {known}."
            return self.operations.refuse(kind, reason, now)
        return self._to_mode(profile, name, kind, now)

    def restore_mode(self, custom_mode: int, now: float) -> int:
        """Ask again for a mode that a command of ours has overtaken; returns the operation's id.

        The number need not be in the profile: whoever chose the mode may know more modes.
        """
        profile, kind = self.profile, OperationKind.RESTORE_MODE
        if profile is None:
            return self.operations.nobody(kind, now)
        goal = ModeGoal(profile.mode_name(custom_mode), custom_mode, profile, kind)
        timing = OperationTiming(self.config.operation_timeout_s)
        return self.operations.begin(goal, Wanted(mode=custom_mode), timing, now)

    def take_control(self, now: float) -> int:
        """Enter the mode in which the vehicle is flown by us; returns the operation's id.

        Where the profile has a `prestream_s`, the stream must be open and setpoints must be
        sent meanwhile: the command goes out when they have come for that long.
        """
        profile, kind = self.profile, OperationKind.TAKE_CONTROL
        if profile is None:
            return self.operations.nobody(kind, now)
        prestream_s = profile.setpoints.prestream_s
        if prestream_s == 0.0 or profile.control_mode is None:
            return self._own_mode(profile.control_mode, kind, now)
        if not self.state.armed:
            # Setpoints for a disarmed vehicle would set it off when it is armed.
            reason = f"{profile.name} is disarmed; arm it before {profile.control_mode} is entered."
            return self.operations.refuse(kind, reason, now)
        if not self.setpoints.is_open:
            reason = (
                f"{profile.name} enters {profile.control_mode} only while setpoints are received; "
                "open the stream and send them first."
            )
            return self.operations.refuse(kind, reason, now)

        def gate(now: float) -> float:
            return self.setpoints.steady_from_s(prestream_s, now)

        return self._to_mode(profile, profile.control_mode, kind, now, gate)

    def hold(self, now: float) -> int:
        """Stop and hold, by the vehicle's own mode (a plane circles); returns the id."""
        mode = None if self.profile is None else self.profile.hold_mode
        return self._own_mode(mode, OperationKind.HOLD, now)

    def land(self, now: float) -> int:
        """Land where it is, by the vehicle's own mode; returns the operation's id.

        It is achieved when the mode is; the landing shows in `VehicleState.landed_state`.
        """
        mode = None if self.profile is None else self.profile.land_mode
        return self._own_mode(mode, OperationKind.LAND, now)

    def land_on_target(self, now: float) -> int:
        """Land on the target of `landing_target`, by the vehicle's own mode; returns the id."""
        rules = None if self.profile is None else self.profile.landing_target
        return self._own_mode(None if rules is None else rules.mode, OperationKind.LAND, now)

    def return_to_launch(self, now: float) -> int:
        """Return to the launch point, by the vehicle's own mode; returns the operation's id."""
        mode = None if self.profile is None else self.profile.return_mode
        return self._own_mode(mode, OperationKind.RETURN_TO_LAUNCH, now)

    # Motors and take-off

    def arm(self, now: float) -> int:
        """Arm the motors; returns the operation's id.

        A mode in which the vehicle cannot be armed, or in which arming would set it off, is left
        for the profile's `arming_mode` first.
        """
        profile, goal = self.profile, ArmGoal(True)
        name = None if profile is None else self._mode_to_arm_in(profile)
        if profile is None or name is None:
            return self._set_armed(goal, now)
        mode = profile.modes[name]
        return self.operations.begin(
            ArmingModeGoal(name, mode, profile),
            Wanted(mode=mode),
            OperationTiming(self.config.operation_timeout_s),
            now,
            then=lambda operation_id, now: self._set_armed(goal, now, operation_id),
        )

    def disarm(self, now: float, force: bool = False) -> int:
        """Disarm the motors, with `force` even in the air; returns the operation's id."""
        return self._set_armed(ArmGoal(False, force), now)

    def take_off(self, height_above_ground_m: float, now: float) -> int:
        """Take off to a height above where it stands; returns the operation's id.

        The vehicle must be armed, and in its control mode where the profile says
        `control_before_takeoff`. An ArduPlane climbs to the height of its own TKOFF_ALT.
        """
        profile, kind = self.profile, OperationKind.TAKE_OFF
        if profile is None:
            return self.operations.nobody(kind, now)
        problem = takeoff_problem(height_above_ground_m, self.state, profile)
        if problem is not None:
            return self.operations.refuse(kind, f"Take-off rejected: {problem}.", now)
        timeout_s = self.config.takeoff_timeout_s or takeoff_timeout_s(height_above_ground_m)
        goal = TakeoffGoal(height_above_ground_m, self.state, profile)
        timing = OperationTiming(timeout_s, doubt_s=_TAKEOFF_DOUBT_S)
        wanted = Wanted(mode=profile.mode_number(profile.takeoff.mode))
        return self.operations.begin(goal, wanted, timing, now)

    # Places and speeds

    def reposition(
        self,
        latitude_deg: float,
        longitude_deg: float,
        altitude_amsl_m: float,
        now: float,
        radius_m: float | None = None,
        keeps_mode: bool = False,
    ) -> int:
        """Send it to a place, which a plane then circles; returns the operation's id.

        Args:
            latitude_deg: WGS-84.
            longitude_deg: WGS-84.
            altitude_amsl_m: above mean sea level.
            now: time in seconds.
            radius_m: of the circle, negative against the clock; None for the vehicle's usual one.
            keeps_mode: whether it is rejected in another mode, where the profile permits that.
        """
        profile, kind = self.profile, OperationKind.REPOSITION
        if profile is None:
            return self.operations.nobody(kind, now)
        place = (latitude_deg, longitude_deg, altitude_amsl_m)
        problem = reposition_problem(place, radius_m, self.state, profile)
        if problem is not None:
            return self.operations.refuse(kind, f"Reposition rejected: {problem}.", now)
        values = self.parameters.values
        usual_m = next((values[name] for name in profile.circle_parameters if name in values), 0.0)
        goal = reposition_goal(place, radius_m, self.state, profile, usual_m)
        timing = OperationTiming(self.config.operation_timeout_s)
        if keeps_mode and profile.reposition_keeps_mode:
            return self.operations.begin(replace(goal, keeps_mode=True), Wanted(), timing, now)
        return self.operations.begin(goal, Wanted(mode=goal.custom_mode), timing, now)

    def change_speed(self, speed_m_s: float, now: float) -> int:
        """Change the speed by command, where the profile says so; returns the operation's id.

        It is achieved when it was acknowledged, as nothing in the vehicle's state shows it.
        """
        profile, kind = self.profile, OperationKind.CHANGE_SPEED
        if profile is None:
            return self.operations.nobody(kind, now)
        problem = speed_problem(speed_m_s, self.mode_name, profile)
        if problem is not None or profile.speed_command is None:
            return self.operations.refuse(kind, f"Speed change rejected: {problem}.", now)
        goal = SpeedGoal(speed_m_s, profile.speed_command.speed_type)
        timing = OperationTiming(self.config.operation_timeout_s)
        return self.operations.begin(goal, Wanted(), timing, now)

    # Setpoints

    def send_setpoint(self, setpoint: SetpointNed, now: float) -> None:
        """Send SET_POSITION_TARGET_LOCAL_NED with what the profile's `setpoints.form` has of it.

        While `own_gap.is_open` it is dropped.

        Raises:
            SetpointError: says why this must not be sent, or not now.
        """
        profile = self.profile
        if profile is None:
            raise SetpointError("No vehicle has been detected yet; wait for its HEARTBEAT.")
        self.notice(now)
        if self.own_gap.is_open:
            return
        pending = self.operations.pending
        if (
            pending is not None
            and pending.goal.kind is OperationKind.TAKE_OFF
            and not profile.setpoints.before_takeoff
        ):
            raise SetpointError(
                f"{profile.name} is taking off; setpoints would keep it on the ground. Wait until "
                "it has taken off."
            )
        if self.setpoints.is_open:
            self._check_interlock(profile)
        if profile.setpoints.acceleration_is_push:
            if self.in_control_mode and self.state.armed:
                self._drag.learn(self.state.attitude, self.state.local_position)
            setpoint = self._drag.added_to(setpoint)
        self.note_setpoint(now)
        self.setpoints.offer(
            setpoint,
            now,
            profile=profile,
            address=self.address,
            time_boot_ms=int(now * 1000.0) % (1 << 32),
        )

    def _check_interlock(self, profile: Profile) -> None:
        if not self.in_control_mode and not profile.setpoints.outside_control_mode:
            raise SetpointError(
                f"{profile.name} is in {self.mode_name}, where setpoints must not be sent; "
                f"change to {profile.control_mode} first."
            )
        if not self.live.known.armed and not profile.setpoints.while_disarmed:
            raise SetpointError(
                f"{profile.name} is disarmed; a setpoint could make it move later. Arm it first."
            )

    # Inside

    def _own_mode(self, name: str | None, kind: OperationKind, now: float) -> int:
        profile = self.profile
        if profile is None:
            return self.operations.nobody(kind, now)
        if name is None:
            why = profile.unsupported or f"{profile.name} has no mode for this."
            sentence = f"{kind.value[0].upper()}{kind.value[1:]} rejected: {why}"
            return self.operations.refuse(kind, sentence, now)
        return self._to_mode(profile, name, kind, now)

    def _to_mode(
        self, profile: Profile, name: str, kind: OperationKind, now: float, gate: Gate | None = None
    ) -> int:
        mode = profile.modes[name]
        timing = OperationTiming(self.config.operation_timeout_s)
        goal = ModeGoal(name, mode, profile, kind)
        return self.operations.begin(goal, Wanted(mode=mode), timing, now, gate)

    def _mode_to_arm_in(self, profile: Profile) -> str | None:
        """Return the mode to change to before arming; None when it may be armed as it is."""
        state, name = self.state, self.mode_name
        if state.armed or name == profile.arming_mode:
            return None
        # The status in a HEARTBEAT is about that HEARTBEAT's mode; CURRENT_MODE may be newer.
        judged = state.heartbeat_mode == state.custom_mode
        cannot_run = profile.status_shows_runnable and judged and state.mode_may_not_run
        return profile.arming_mode if cannot_run or name in profile.not_armed_in else None

    def _set_armed(self, goal: ArmGoal, now: float, operation_id: int | None = None) -> int:
        if self.profile is None:
            return self.operations.nobody(goal.kind, now)
        timing = OperationTiming(self.config.operation_timeout_s)
        wanted = Wanted(armed=goal.armed)
        return self.operations.begin(goal, wanted, timing, now, operation_id=operation_id)
