"""The frozen state of one vehicle, its latest, and how old that is.

`state.reduce` makes the next state from a message.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from mavlink_vehicle.codec import MAVLINK_1_HEARTBEATS, mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions.frames import (
    LocalFrame,
    Quaternion,
    Vector3,
    attitude_enu_flu,
    yaw_ned_to_enu,
)
from mavlink_vehicle.state.status_text import StatusText, StatusTexts
from mavlink_vehicle.state.telemetry import (
    Attitude,
    Battery,
    EstimatorReport,
    GlobalPosition,
    GpsFix,
    Home,
    LocalPosition,
    MissionProgress,
    Origin,
)
from mavlink_vehicle.state.warning_signs import NO_SIGNS, Failsafe, Signs

_UINT32 = 1 << 32
# More than the quickest round trip: jitter of a usual link.
_QUICK_S = 0.15
# By how much the quickest round trip may grow in a second.
_SLOWER_PER_S = 0.005
# With 2 s between two questions, the rate is known to a few per cent.
_KEPT = 4
_LEAST_SPAN_S = 1.5
# A simulator that keeps up is nearer to our time than this share.
_DRIFT_MAX = 0.2
# A time since boot comes at least once a second (SYSTEM_TIME).
_OF_ONE_CLOCK_MS = 2000
_BOOT = mavlink.MAV_STATE_BOOT
_CLOCK_KINDS, _CLOCK_MESSAGES = 2, 3
_RESTS_S = 2.0

REORDER_LIMIT_MS = 3000
"""Time since boot going back by less is a late packet; forward by more, another clock."""

Changes: TypeAlias = dict[str, object]
"""New values of a state, by attribute."""


class ClockDoubt(NamedTuple):
    """A time since boot that is not by the clock of the vehicle that was followed.

    Attributes:
        since_s: when the first message of it came; silences are added.
        heard_s: when the last one came.
        begun_s: our time at which it was 0.
        newest_ms: the newest.
        kinds: classes of the messages that had it.
        messages: how many of them were newer than those before.
    """

    since_s: float
    heard_s: float
    begun_s: float
    newest_ms: int
    kinds: frozenset[type]
    messages: int

    @property
    def is_clock(self) -> bool:
        """Whether it continues, and is not that of one message."""
        return len(self.kinds) >= _CLOCK_KINDS or self.messages >= _CLOCK_MESSAGES


class RestartSigns(NamedTuple):
    """Signs of a restart, none of which is enough; see `state.restarts`.

    Attributes:
        doubt: another clock in the time since boot.
        refuted_s: when such a clock was last found beside that of the vehicle.
        disarmed_s: when HEARTBEAT showed last that it was disarmed.
        booting_s: when HEARTBEAT showed MAV_STATE_BOOT after something later.
        restarted_s: when a clock showed the last restart.
        in_turn: how often one kind of message came by that of the vehicle after another one.
        in_turn_s: when it did last.
    """

    doubt: ClockDoubt | None = None
    refuted_s: float = -math.inf
    disarmed_s: float = -math.inf
    booting_s: float = -math.inf
    restarted_s: float = -math.inf
    in_turn: int = 0
    in_turn_s: float = -math.inf


_NO_RESTART_SIGNS = RestartSigns()


@dataclass(frozen=True)
class VehicleState:
    """All that is known about one vehicle; the parts are None until they came.

    Attributes:
        system_id: MAVLink system id; 0 until the vehicle is found, if any will do.
        component_id: MAVLink component id of its autopilot.
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        last_heartbeat_s: when the last HEARTBEAT came.
        heartbeats_1: how many of the last HEARTBEATs, in a row, came in MAVLink 1.
        armed: the armed flag of HEARTBEAT.
        armed_heard: the same of the last one that arrived, however late by its sequence number.
        base_mode: as sent.
        custom_mode: as sent; its meaning depends on the firmware.
        intended_mode: the mode that was chosen, of CURRENT_MODE; 0 when not reported.
        system_status: MAV_STATE. Don't derive `armed` from it.
        heartbeat_mode: the mode that HEARTBEAT showed last; `system_status` is about it.
        landed_state: of EXTENDED_SYS_STATE.
        failsafe: the failsafe in force, None when there is none.
        fence_breached: of FENCE_STATUS, or of SYS_STATUS where a fence is enabled.
        fence_reported_s: when FENCE_STATUS came last.
        radio_ok: whether SYS_STATUS calls the pilot's radio healthy; None when it does not say.
        signs: since when the vehicle shows that something is wrong.
        global_position: None also while the vehicle sends 0, 0.
        battery: the worst, with the lowest charge of all that count; see `state.batteries`.
        batteries: each battery of BATTERY_STATUS, by its number.
        battery_summary: what SYS_STATUS says.
        ground_altitude_amsl_m: where it last stood, disarmed. PX4's home moves in flight.
        ground_down_m: the same in the local frame.
        rests_s: since when it reports that it stands, disarmed; None while it does not.
        mission: how the stored mission stands.
        terrain_ready: whether it has the terrain around it, by TERRAIN_REPORT; None when it does
            not say.
        wind_ned_m_s: velocity of the air as the vehicle estimates it; None before it is reported.
        sensors_health: SYS_STATUS.onboard_control_sensors_health.
        prearm_ok: whether the autopilot would arm, None when it doesn't report it.
        boot_count: how many restarts were seen; `state.restarts` says by what.
        clock_count: how many other clocks were followed since: after restarts, and set ones.
        boot_time_ms: the newest time since boot, counted on beyond 32 bits (49.7 days).
        boot_time_s: when it came.
        restart_signs: what may be a restart.
        boot_announced_s: when HEARTBEAT announced a restart that no time since boot has
            shown yet.
        capabilities: MAV_PROTOCOL_CAPABILITY of AUTOPILOT_VERSION.
        estimator_reported: whether it has ever reported how its estimator is; one that has is
            waited for after a restart, when there is a position before a report about it.
        texts: STATUSTEXTs; see `status_texts`.
    """

    system_id: int = 0
    component_id: int = 1
    autopilot: int = 0
    vehicle_type: int = 0
    last_heartbeat_s: float | None = None
    heartbeats_1: int = 0
    armed: bool = False
    armed_heard: bool = False
    base_mode: int = 0
    custom_mode: int = 0
    intended_mode: int = 0
    system_status: int = 0
    heartbeat_mode: int = 0
    landed_state: LandedState = LandedState.UNDEFINED
    failsafe: Failsafe | None = None
    fence_breached: bool = False
    fence_reported_s: float | None = None
    radio_ok: bool | None = None
    signs: Signs = NO_SIGNS
    global_position: GlobalPosition | None = None
    local_position: LocalPosition | None = None
    attitude: Attitude | None = None
    battery: Battery | None = None
    batteries: tuple[Battery, ...] = ()
    battery_summary: Battery | None = None
    home: Home | None = None
    origin: Origin | None = None
    gps: GpsFix | None = None
    estimator: EstimatorReport | None = None
    mission: MissionProgress | None = None
    ground_altitude_amsl_m: float | None = None
    ground_down_m: float | None = None
    rests_s: float | None = None
    terrain_ready: bool | None = None
    wind_ned_m_s: Vector3 | None = None
    sensors_health: int | None = None
    prearm_ok: bool | None = None
    firmware_version: str | None = None
    capabilities: int = 0
    boot_count: int = 0
    clock_count: int = 0
    boot_time_ms: int | None = None
    boot_time_s: float = -math.inf
    restart_signs: RestartSigns = _NO_RESTART_SIGNS
    boot_announced_s: float | None = None
    estimator_reported: bool = False
    texts: StatusTexts = field(default_factory=StatusTexts)

    @property
    def status_texts(self) -> tuple[StatusText, ...]:
        """The last 20 texts, oldest first."""
        return self.texts.texts

    @property
    def speaks_mavlink_1(self) -> bool:
        """Whether it speaks MAVLink 1 only, which lacks extension fields and numbers above 255."""
        return self.heartbeats_1 >= MAVLINK_1_HEARTBEATS

    @property
    def booting(self) -> bool:
        """Whether its last HEARTBEAT said MAV_STATE_BOOT, or less."""
        return bool(self.system_status <= _BOOT)

    @property
    def mode_may_not_run(self) -> bool:
        """Whether the selected mode cannot run, or that isn't known yet (PX4).

        Disarmed, a PX4 lets any mode be selected, and says with MAV_STATE_UNINIT (0) that it
        cannot run there. In flight it rejects such modes.
        """
        unsure = not self.armed and self.heartbeat_mode != self.custom_mode
        return self.system_status == 0 or unsure

    @property
    def position_valid(self) -> bool:
        """Whether there is a global position that the vehicle's estimator stands by."""
        if self.global_position is None:
            return False
        if self.estimator is None:
            return not self.estimator_reported
        return self.estimator.horizontal_position_ok

    @property
    def has_pose(self) -> bool:
        """Whether `pose_enu` returns a pose, which takes longer to compute."""
        place = self.global_position
        if place is None or self.local_position is None or not self.position_valid:
            return False
        return self.attitude is not None or place.heading_ned_rad is not None

    def pose_enu(self, frame: LocalFrame) -> tuple[Vector3, float, Quaternion] | None:
        """Return position (m), yaw (rad) and attitude in a local frame with the axes of ROS.

        They are those of GLOBAL_POSITION_INT and ATTITUDE; before there is an ATTITUDE, level with
        the heading of the first. None without a valid position or a heading. A local position is
        required, too: an ArduCopter sends GLOBAL_POSITION_INT before its estimator uses the GPS,
        but LOCAL_POSITION_NED only from then on.
        """
        place, attitude = self.global_position, self.attitude
        if place is None or self.local_position is None or not self.position_valid:
            return None
        roll_rad, pitch_rad, yaw_ned_rad = 0.0, 0.0, place.heading_ned_rad
        if attitude is not None:
            roll_rad, pitch_rad = attitude.roll_rad, attitude.pitch_rad
            yaw_ned_rad = attitude.yaw_ned_rad
        if yaw_ned_rad is None:
            return None
        return (
            frame.enu_m((place.latitude_deg, place.longitude_deg, place.altitude_amsl_m)),
            yaw_ned_to_enu(yaw_ned_rad),
            attitude_enu_flu(roll_rad, pitch_rad, yaw_ned_rad),
        )


def is_on_ground(state: VehicleState) -> bool:
    """Return whether the vehicle stands, disarmed: where it then is, the ground is."""
    return state.landed_state is LandedState.ON_GROUND and not state.armed


def with_rest(state: VehicleState, now: float) -> VehicleState:
    """Return a state after a report of what it stands on or whether it is armed."""
    if is_on_ground(state) is (state.rests_s is not None):
        return state
    return evolve(state, {"rests_s": now if state.rests_s is None else None})


def shows_ground(state: VehicleState, ground_m: float | None, now: float) -> bool:
    """Return whether the ground is where the vehicle is.

    Another ground than a known one counts once two HEARTBEATs have had time to deny it: a single
    report that it stands there may be somebody else's.
    """
    if state.rests_s is None:
        return False
    return ground_m is None or now - state.rests_s >= _RESTS_S


_set_attributes = VehicleState.__dict__["__dict__"].__set__


def evolve(state: VehicleState, changes: Changes) -> VehicleState:
    """Do what dataclasses.replace does, several times faster: this runs for every message."""
    if not changes:
        return state
    new = object.__new__(VehicleState)
    _set_attributes(new, state.__dict__ | changes)
    return new


class LiveState:
    """The latest state, made when it is asked for: measurements come more often than that.

    Attributes:
        known: the state without the measurements that came since it was asked for last.
        measured: these measurements, by attribute of the state.
        boot_time_ms: the newest time since boot.
    """

    __slots__ = ("boot_time_ms", "known", "measured")

    def __init__(self, state: VehicleState) -> None:
        """Begin with a state."""
        self.set(state)

    def set(self, state: VehicleState) -> None:
        """Replace the whole state."""
        self.known = state
        self.measured: Changes = {}
        self.boot_time_ms = state.boot_time_ms

    def get(self) -> VehicleState:
        """Return the state; the same object until something comes."""
        if self.measured:
            self.known = evolve(self.known, self.measured)
            self.measured = {}
        return self.known

    @property
    def global_position(self) -> GlobalPosition | None:
        """The position; the state need not be made for it."""
        position = self.measured.get("global_position", self.known.global_position)
        return position if isinstance(position, GlobalPosition) else None

    def is_next(self, time_boot_ms: int) -> bool:
        """Return whether a time since boot follows the newest, of a clock that is not in doubt."""
        newest_ms = self.boot_time_ms
        return (
            newest_ms is not None
            and newest_ms <= time_boot_ms <= newest_ms + REORDER_LIMIT_MS
            and self.known.restart_signs.doubt is None
        )

    def measure(self, changes: Changes, time_boot_ms: int, now: float) -> None:
        """Take a measurement, of a time since boot that `is_next`."""
        measured = self.measured
        measured |= changes
        measured["boot_time_ms"] = self.boot_time_ms = time_boot_ms
        measured["boot_time_s"] = now


class DataAge:
    """Relates the clock of one vehicle to ours, to know how old its data is when it is read.

    A starved server reads packets that have waited in a buffer for seconds, in order, and each
    looks new. So the vehicle's time since boot is compared with ours. The two clocks are related by
    an answer to TIMESYNC that came quickly: a message read just before it was new. Between such
    answers the vehicle's clock is taken to run on at the rate that it showed between the last ones,
    as that of a simulator may run at a tenth or at twenty times of ours. An answer that took longer
    than the quickest says nothing; the quickest may become slower in time, as links do.
    """

    def __init__(self) -> None:
        """Begin without knowing."""
        self._known: deque[tuple[float, int]] = deque(maxlen=_KEPT)
        self._rate: float | None = None
        self._quickest: tuple[float, float] | None = None
        self._clock_count = 0

    @property
    def keeps_our_time(self) -> bool:
        """Whether the vehicle's clock runs as ours does, or that is not known."""
        return self._rate is None or abs(self._rate - 1.0) < _DRIFT_MAX

    def answered(
        self,
        round_trip_s: float,
        vehicle_ns: int,
        boot_ms: int | None,
        clock_count: int,
        now: float,
    ) -> None:
        """Process an answer to TIMESYNC.

        Args:
            round_trip_s: how long it took until it was read.
            vehicle_ns: the vehicle's time in it: since boot on ArduPilot and PX4 (observed).
            boot_ms: the vehicle's newest time since boot that was read before it, or None.
            clock_count: which clock of the vehicle that is.
            now: time in seconds.
        """
        if clock_count != self._clock_count:
            self._clock_count = clock_count
            self._known.clear()
            self._rate = None
        quickest_s = round_trip_s
        if self._quickest is not None:
            before_s, at_s = self._quickest
            quickest_s = min(quickest_s, before_s + _SLOWER_PER_S * (now - at_s))
        self._quickest = quickest_s, now
        if boot_ms is None or round_trip_s > quickest_s + _QUICK_S:
            return
        vehicle_ms = vehicle_ns // 1_000_000 % _UINT32
        if abs(_difference_ms(vehicle_ms, boot_ms)) > _OF_ONE_CLOCK_MS:
            vehicle_ms = boot_ms  # it counts from elsewhere
        self._known.append((now, vehicle_ms))
        first_s, first_ms = self._known[0]
        passed_ms, passed_s = _difference_ms(vehicle_ms, first_ms), now - first_s
        known = passed_s >= _LEAST_SPAN_S and passed_ms >= 0
        self._rate = 1e-3 * passed_ms / passed_s if known else None

    def age_s(self, boot_ms: int | None, clock_count: int, now: float) -> float | None:
        """Return the age of a sample by the vehicle's clock; None while unknown, or it stands.

        The shortest time on the link does not count.

        Args:
            boot_ms: when the vehicle took it, since boot; None: not known.
            clock_count: which clock of the vehicle that is.
            now: time in seconds.
        """
        if boot_ms is None or clock_count != self._clock_count or not self._rate:
            return None
        last_s, last_ms = self._known[-1]
        return max(now - last_s - 1e-3 * _difference_ms(boot_ms, last_ms) / self._rate, 0.0)


def _difference_ms(boot_ms: int, before_ms: int) -> int:
    """Return the time between two times since boot; the counter ends after 49.7 days."""
    return (boot_ms - before_ms + _UINT32 // 2) % _UINT32 - _UINT32 // 2
