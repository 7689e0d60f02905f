"""The frozen state of one vehicle; `state.reduce` makes the next one from a message."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from mavlink_vehicle.codec import MAVLINK_1_HEARTBEATS, mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.positions.frames import Vector3
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

_BOOT = mavlink.MAV_STATE_BOOT
_CLOCK_KINDS, _CLOCK_MESSAGES = 2, 3

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
    """

    doubt: ClockDoubt | None = None
    refuted_s: float = -math.inf
    disarmed_s: float = -math.inf
    booting_s: float = -math.inf
    restarted_s: float = -math.inf


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
        mission: how the stored mission stands.
        terrain_ready: whether it has the terrain around it, by TERRAIN_REPORT; None when it does
            not say.
        wind_ned_m_s: velocity of the air as the vehicle estimates it; None before it is reported.
        sensors_health: SYS_STATUS.onboard_control_sensors_health.
        prearm_ok: whether the autopilot would arm, None when it doesn't report it.
        boot_count: how many restarts were seen; `state.restarts` says by what.
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
    terrain_ready: bool | None = None
    wind_ned_m_s: Vector3 | None = None
    sensors_health: int | None = None
    prearm_ok: bool | None = None
    firmware_version: str | None = None
    capabilities: int = 0
    boot_count: int = 0
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


def is_on_ground(state: VehicleState) -> bool:
    """Return whether the vehicle stands, disarmed: where it then is, the ground is."""
    return state.landed_state is LandedState.ON_GROUND and not state.armed


_set_attributes = VehicleState.__dict__["__dict__"].__set__


def evolve(state: VehicleState, changes: Changes) -> VehicleState:
    """Do what dataclasses.replace does, several times faster: this runs for every message."""
    if not changes:
        return state
    new = object.__new__(VehicleState)
    _set_attributes(new, state.__dict__ | changes)
    return new
