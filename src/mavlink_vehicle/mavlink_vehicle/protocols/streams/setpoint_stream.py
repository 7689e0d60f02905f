"""SET_POSITION_TARGET_LOCAL_NED, behind an interlock.

The stream is CLOSED until it is opened, and a setpoint offered to a closed stream is an error:
so nothing that moves the vehicle can leave by accident. Setpoints are checked before anything
is built from them; a NaN in a position makes ArduPilot's simulator abort, and a real flight
controller is not the place to find out.
"""

from __future__ import annotations

import enum
import itertools
import math
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_
from typing import ClassVar

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.errors import SetpointError
from mavlink_vehicle.events import StreamClosed, VehicleEvent
from mavlink_vehicle.positions.frames import (
    Vector3,
    enu_to_ned,
    normalize_angle,
    yaw_enu_to_ned,
)
from mavlink_vehicle.profiles import Profile, SetpointField
from mavlink_vehicle.protocols.machine import Machine, Table
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import SendingRank, VehicleService
from mavlink_vehicle.state.vehicle_state import VehicleState, evolve

# POSITION_TARGET_TYPEMASK: a set bit says "ignore".
IGNORE_POSITION = 0b0000_0000_0111
IGNORE_VELOCITY = 0b0000_0011_1000
IGNORE_ACCELERATION = 0b0001_1100_0000
IGNORE_YAW = 0b0100_0000_0000
IGNORE_YAW_RATE = 0b1000_0000_0000

MAX_ABS_VALUE = 1e6
"""Metres, m/s or m/s2 beyond this are a mistake of the sender, not a place to go."""

MAX_GAP_S = 0.5
"""A longer pause restarts the stream. PX4 takes 1 s (COM_OF_LOSS_T) as the end of it."""

# PX4 takes the stream for lost after COM_OF_LOSS_T (1 s); the link's jitter comes on top.
STREAM_GAP_S = 0.8
# A setpoint that is slower stops the vehicle; a rover's stop has a direction.
_STOP_M_S = 0.01
# A setpoint stream that ended longer ago belonged to another flight.
_STREAM_OVER_S = 10.0

_MOTION = SetpointField.POSITION | SetpointField.VELOCITY | SetpointField.ACCELERATION


_GROUPS = (
    SetpointField.POSITION,
    SetpointField.VELOCITY,
    SetpointField.ACCELERATION,
    SetpointField.YAW,
    SetpointField.YAW_RATE,
)
_FIELDS = {
    given: reduce(or_, itertools.compress(_GROUPS, given), SetpointField.NONE)
    for given in itertools.product((False, True), repeat=len(_GROUPS))
}
"""The groups by which of them are given: to join flags takes longer than all else here."""


@dataclass(frozen=True, slots=True)
class SetpointNed:
    """A position or motion in the vehicle's local NED frame; None means "not given".

    Instead of all these, ``drive_frd_m_s`` is a velocity along the axes of the vehicle (forward,
    right, down), which comes with a yaw rate, for a profile with ``drives_by_turn_rate``.
    """

    position_ned_m: Vector3 | None = None
    velocity_ned_m_s: Vector3 | None = None
    acceleration_ned_m_s2: Vector3 | None = None
    yaw_ned_rad: float | None = None
    yaw_rate_rad_s: float | None = None
    drive_frd_m_s: Vector3 | None = None

    @classmethod
    def of_enu(
        cls,
        position_enu_m: Vector3 | None,
        velocity_enu_m_s: Vector3 | None,
        acceleration_enu_m_s2: Vector3 | None,
        yaw_enu_rad: float,
        yaw_rate_enu_rad_s: float = 0.0,
    ) -> SetpointNed:
        """Return the setpoint for one in the axes of ROS, with the same origin.

        A yaw rate of 0 is not given: the vehicle turns to the yaw, and no further.
        """
        return cls(
            None if position_enu_m is None else enu_to_ned(position_enu_m),
            None if velocity_enu_m_s is None else enu_to_ned(velocity_enu_m_s),
            None if acceleration_enu_m_s2 is None else enu_to_ned(acceleration_enu_m_s2),
            yaw_enu_to_ned(yaw_enu_rad),
            # Seen from above, a positive rate is counter-clockwise in ENU and clockwise in NED.
            -yaw_rate_enu_rad_s if yaw_rate_enu_rad_s else None,
        )

    def fields(self) -> SetpointField:
        """Return which groups are given."""
        return _FIELDS[
            self.position_ned_m is not None,
            self.velocity_ned_m_s is not None,
            self.acceleration_ned_m_s2 is not None,
            self.yaw_ned_rad is not None,
            self.yaw_rate_rad_s is not None,
        ]

    def reduced_to(self, form: SetpointField) -> SetpointNed:
        """Return it with only those groups that `form` has."""
        return replace(
            self,
            position_ned_m=self.position_ned_m if SetpointField.POSITION in form else None,
            velocity_ned_m_s=self.velocity_ned_m_s if SetpointField.VELOCITY in form else None,
            acceleration_ned_m_s2=(
                self.acceleration_ned_m_s2 if SetpointField.ACCELERATION in form else None
            ),
            yaw_ned_rad=self.yaw_ned_rad if SetpointField.YAW in form else None,
            yaw_rate_rad_s=self.yaw_rate_rad_s if SetpointField.YAW_RATE in form else None,
        )

    def type_mask(self) -> int:
        """Return the POSITION_TARGET_TYPEMASK of what is given."""
        mask = 0
        mask |= IGNORE_POSITION if self.position_ned_m is None else 0
        no_velocity = self.velocity_ned_m_s is None and self.drive_frd_m_s is None
        mask |= IGNORE_VELOCITY if no_velocity else 0
        mask |= IGNORE_ACCELERATION if self.acceleration_ned_m_s2 is None else 0
        mask |= IGNORE_YAW if self.yaw_ned_rad is None else 0
        mask |= IGNORE_YAW_RATE if self.yaw_rate_rad_s is None else 0
        return mask


def legal_setpoint(setpoint: SetpointNed, profile: Profile) -> SetpointNed:
    """Return what of the setpoint is sent: its groups that are of `profile.setpoints.form`.

    Raises:
        SetpointError: a number is not finite or absurd, also in what would be left out, or
            what remains is a combination that this vehicle type ignores or misunderstands.
    """
    if not profile.setpoints.motions:
        way = "; it is sent to targets by reposition" if profile.reposition else ""
        raise SetpointError(f"{profile.name} does not follow setpoints{way}.")
    _check_numbers(setpoint)
    if setpoint.drive_frd_m_s is not None:
        return _legal_drive(setpoint, profile)
    given, form = setpoint.fields(), profile.setpoints.form
    sent = given & form
    if sent & _MOTION not in profile.setpoints.motions:
        motion = given & _MOTION
        name = motion.name if motion else "neither position, velocity nor acceleration"
        raise SetpointError(f"{profile.name} does not follow setpoints with {name}.")
    return setpoint if sent == given else setpoint.reduced_to(form)


def _stops(setpoint: SetpointNed) -> bool:
    """Whether it stops a vehicle wherever that is."""
    velocity = setpoint.velocity_ned_m_s
    leads = setpoint.position_ned_m or setpoint.acceleration_ned_m_s2 or setpoint.drive_frd_m_s
    return velocity is not None and not leads and math.hypot(*velocity) < _STOP_M_S


def _legal_drive(setpoint: SetpointNed, profile: Profile) -> SetpointNed:
    if not profile.setpoints.drives_by_turn_rate:
        raise SetpointError(f"{profile.name} does not follow a speed with a turn rate.")
    if setpoint.yaw_rate_rad_s is None or setpoint.fields() != SetpointField.YAW_RATE:
        raise SetpointError("A speed along the nose can be combined only with a yaw rate.")
    return setpoint


def _check_numbers(setpoint: SetpointNed) -> None:
    for name, vector in (
        ("position_ned_m", setpoint.position_ned_m),
        ("velocity_ned_m_s", setpoint.velocity_ned_m_s),
        ("acceleration_ned_m_s2", setpoint.acceleration_ned_m_s2),
        ("drive_frd_m_s", setpoint.drive_frd_m_s),
    ):
        if vector is not None and not all(abs(value) <= MAX_ABS_VALUE for value in vector):
            raise SetpointError(
                f"{name} is {vector}: give three finite numbers of at most {MAX_ABS_VALUE:g}."
            )
    for name, angle in (
        ("yaw_ned_rad", setpoint.yaw_ned_rad),
        ("yaw_rate_rad_s", setpoint.yaw_rate_rad_s),
    ):
        if angle is not None and not math.isfinite(angle):
            raise SetpointError(f"{name} is {angle}: give a finite number or None.")


def setpoint_message(setpoint: SetpointNed, address: Address, time_boot_ms: int) -> Message:
    """Build SET_POSITION_TARGET_LOCAL_NED in MAV_FRAME_LOCAL_NED, or in MAV_FRAME_BODY_NED.

    The setpoint must be legal: its numbers are taken as they are.
    """
    frame = mavlink.MAV_FRAME_LOCAL_NED
    if setpoint.drive_frd_m_s is not None:
        frame = mavlink.MAV_FRAME_BODY_NED
    position = setpoint.position_ned_m or (0.0, 0.0, 0.0)
    velocity = setpoint.drive_frd_m_s or setpoint.velocity_ned_m_s or (0.0, 0.0, 0.0)
    acceleration = setpoint.acceleration_ned_m_s2 or (0.0, 0.0, 0.0)
    return mavlink.MAVLink_set_position_target_local_ned_message(
        time_boot_ms=time_boot_ms,
        target_system=address.target_system,
        target_component=address.target_component,
        coordinate_frame=frame,
        type_mask=setpoint.type_mask(),
        x=position[0],
        y=position[1],
        z=position[2],
        vx=velocity[0],
        vy=velocity[1],
        vz=velocity[2],
        afx=acceleration[0],
        afy=acceleration[1],
        afz=acceleration[2],
        yaw=normalize_angle(setpoint.yaw_ned_rad) if setpoint.yaw_ned_rad is not None else 0.0,
        yaw_rate=setpoint.yaw_rate_rad_s or 0.0,
    )


class StreamState(enum.Enum):
    """Whether setpoints may leave."""

    CLOSED = "closed"
    OPEN = "open"


class StreamInput(enum.Enum):
    """An input of the interlock."""

    OPEN = "open"
    CLOSE = "close"
    END = "end"


@dataclass
class StreamStatistics:
    """Counters since the stream was last opened.

    Attributes:
        sent: setpoints sent.
        max_gap_s: the longest time between two of them.
        last_sent_s: when the last one left, None before the first.
    """

    sent: int = 0
    max_gap_s: float = 0.0
    last_sent_s: float | None = None


class SetpointStream(Machine[VehicleEvent], VehicleService):
    """The interlock and the counters; has no timer, as the caller sets the pace.

    Attributes:
        is_open: whether setpoints may leave.
        statistics: counters since it was last opened.
    """

    rank = SendingRank.SETPOINTS
    commands = True

    def __init__(self) -> None:
        """Begin closed."""
        super().__init__(StreamState.CLOSED)
        self.is_open = False
        self.statistics = StreamStatistics()
        self._running_since_s = math.inf
        self._offered = SetpointNed()

    def steady_from_s(self, duration_s: float, now: float) -> float:
        """Return when it will have run for `duration_s` without a pause; infinity if it doesn't."""
        last_sent_s = self.statistics.last_sent_s
        if not self.is_open or last_sent_s is None or now - last_sent_s > MAX_GAP_S:
            return math.inf
        return self._running_since_s + duration_s

    def open(self, now: float) -> None:
        """Allow setpoints. Opening an open stream changes nothing."""
        self._fire(StreamInput.OPEN, now)

    def close(self) -> None:
        """Forbid setpoints, also those that wait in the outbox."""
        self._fire(StreamInput.CLOSE, 0.0)

    def end(self) -> None:
        """Forbid further setpoints for an operation of ours; a stop that waits is still sent.

        Without it a vehicle that does not receive the operation's command would follow its last
        velocity for seconds (ArduCopter: GUID_TIMEOUT).
        """
        self._fire(StreamInput.END, 0.0)

    def close_for(self, reason: str) -> None:
        """Forbid setpoints, as the vehicle no longer follows ours; reported if it was open."""
        if self.is_open:
            self.close()
            self.events.append(StreamClosed(reason))

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Forbid setpoints."""
        self.close_for(reason)

    def offer(
        self,
        setpoint: SetpointNed,
        now: float,
        *,
        profile: Profile,
        address: Address,
        time_boot_ms: int,
    ) -> None:
        """Put a setpoint into the outbox.

        Raises:
            SetpointError: the stream is closed, or the setpoint is not legal.
        """
        if not self.is_open:
            raise SetpointError("The setpoint stream is closed; open it before sending.")
        reduced = legal_setpoint(setpoint, profile)
        self.outbox.append(setpoint_message(reduced, address, time_boot_ms))
        self._offered = reduced
        statistics = self.statistics
        if statistics.last_sent_s is None or now - statistics.last_sent_s > MAX_GAP_S:
            self._running_since_s = now
        statistics.sent += 1
        if statistics.last_sent_s is not None:
            statistics.max_gap_s = max(statistics.max_gap_s, now - statistics.last_sent_s)
        statistics.last_sent_s = now

    def _allow(self, now: float) -> None:
        self.is_open = True
        self.statistics = StreamStatistics()

    def _forbid(self, now: float) -> None:
        self.is_open = False
        self.outbox.clear()

    def _finish(self, now: float) -> None:
        self.is_open = False
        del self.outbox[: -1 if _stops(self._offered) else None]

    table: ClassVar[Table] = {
        (StreamState.CLOSED, StreamInput.OPEN): (StreamState.OPEN, _allow),
        (StreamState.OPEN, StreamInput.OPEN): (StreamState.OPEN, None),
        (StreamState.OPEN, StreamInput.CLOSE): (StreamState.CLOSED, _forbid),
        (StreamState.OPEN, StreamInput.END): (StreamState.CLOSED, _finish),
        (StreamState.CLOSED, StreamInput.CLOSE): (StreamState.CLOSED, _forbid),
        (StreamState.CLOSED, StreamInput.END): (StreamState.CLOSED, None),
    }


class StreamGap:
    """Marks the state of a vehicle that may have left its mode because no setpoint came.

    Attributes:
        heard_s: when the vehicle was heard last; `heard` need not be called for a message that
            does not show the mode and comes within `STREAM_GAP_S` of it.
    """

    def __init__(self) -> None:
        """Begin before any message."""
        self.heard_s = self._setpoint_s = -math.inf

    def heard(
        self, state: VehicleState, profile: Profile | None, shows_mode: bool, now: float
    ) -> VehicleState:
        """Return the state with a gap, if any, before a message is processed.

        Args:
            state: the state until now.
            profile: the vehicle's.
            shows_mode: whether the message shows the mode.
            now: time in seconds.
        """
        silent = now - self.heard_s > STREAM_GAP_S
        self.heard_s = now
        gap_s = now - self._setpoint_s
        # Perhaps none arrived either while nothing was heard.
        if silent or (shows_mode and gap_s > STREAM_GAP_S):
            return after_gap(state, profile, gap_s, now)
        return state

    def sent(self, now: float) -> float:
        """Record that a setpoint goes out; return for how long none did before."""
        gap_s, self._setpoint_s = now - self._setpoint_s, now
        return gap_s


def after_gap(
    state: VehicleState, profile: Profile | None, gap_s: float, now: float
) -> VehicleState:
    """Return the state with a gap of the setpoints, where the vehicle may leave its mode for it.

    Args:
        state: the state until now.
        profile: the vehicle's.
        gap_s: for how long no setpoint went out.
        now: time in seconds.
    """
    if profile is None or profile.setpoints.prestream_s == 0.0 or gap_s > _STREAM_OVER_S:
        return state
    if state.custom_mode != profile.control_number:
        return state
    return evolve(state, {"signs": state.signs._replace(stream_s=now)})
