"""Telemetry about the vehicle's condition, one function per message.

Values before the battery is known and so on are those the firmware was recorded to send.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.autopilot.devices.outputs import OUTPUTS
from mavlink_sitl.exchange import FurtherBattery
from mavlink_sitl.mavlink.codec import Extended, Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import (
    Snapshot,
    boot_ms,
    to_i16,
    to_i32,
    to_int,
    to_u16,
)

MAX_VOLTAGE_MV = 65534


def heartbeat(s: Snapshot, was_position_controlled: bool = False) -> Message:
    """HEARTBEAT; at a mode change the flag of the old mode still counts, as recorded."""
    vehicle = s.vehicle
    mode = vehicle.mode.spec
    personality = vehicle.personality
    base_mode = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    base_mode |= mode.base_flags if vehicle.started else personality.boot_flags
    # RTL's controller stops with the motors, LAND's continues, as recorded.
    controlled = vehicle.mode.position_controlled and (vehicle.armed or mode.behaviour != "rtl")
    if controlled or was_position_controlled:
        base_mode |= dialect.MAV_MODE_FLAG_GUIDED_ENABLED
    if vehicle.soft_armed:
        base_mode |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
    number = mode.number
    if not vehicle.started and personality.boot_mode is not None:
        number = personality.boot_mode
    return dialect.MAVLink_heartbeat_message(
        personality.mav_type, personality.mav_autopilot, base_mode, number,
        int(vehicle.system_status), 3,
    )  # fmt: skip


# Bits of SYS_STATUS.
_MAGNETOMETER, _GPS, _RADIO = 0x00000004, 0x00000020, 0x00010000
_GEOFENCE, _ESTIMATOR, _TERRAIN = 0x00100000, 0x00200000, 0x00400000
_LOGGING, _BATTERY, _PREARM = 0x01000000, 0x02000000, 0x10000000


def _sensors(vehicle: Commander) -> tuple[int, int, int]:
    """The bits of SYS_STATUS: sensors present, enabled and healthy."""
    sensors = vehicle.personality.sensors
    controlled = sensors.by_mode.get(vehicle.mode.spec.name, sensors.otherwise)
    present, enabled = sensors.present, sensors.enabled | controlled
    healthy = sensors.healthy | controlled
    if not vehicle.battery_known:
        present &= ~_TERRAIN
        enabled &= ~_TERRAIN
        healthy &= ~(_TERRAIN | _BATTERY | _MAGNETOMETER)
    estimator, fence = vehicle.estimator, vehicle.fence
    if estimator.gps_started:
        present, enabled, healthy = present | _GPS, enabled | _GPS, healthy | _GPS
    if estimator.has_origin:
        enabled |= _ESTIMATOR
        well = estimator.using_gps or not sensors.estimator_needs_gps
        healthy |= _ESTIMATOR if well else 0
    if vehicle.armed:
        enabled |= _LOGGING
    if vehicle.armed or vehicle.arming.checks_passed:
        healthy |= _PREARM
    if vehicle.failsafe.battery_level:
        healthy &= ~_BATTERY
    if vehicle.pilot.lost or vehicle.pilot.throttle_failed:
        healthy &= ~_RADIO
    if fence.present:
        present |= _GEOFENCE
        enabled |= _GEOFENCE if fence.enabled and vehicle.parameters["FENCE_ACTION"] else 0
    if not fence.breached:
        healthy |= _GEOFENCE
    return present, enabled, healthy


def sys_status(s: Snapshot) -> Message:
    """SYS_STATUS; before the power monitor has readings there is no voltage."""
    vehicle = s.vehicle
    known = vehicle.battery_known
    present, enabled, health = _sensors(vehicle)
    battery = s.battery
    return dialect.MAVLink_sys_status_message(
        present,
        enabled,
        health,
        0,
        to_int(battery.voltage_v * 1000.0, 0, MAX_VOLTAGE_MV) if known else 0,
        to_i16(battery.current_a * 100.0) if known else -1,
        to_int(battery.remaining_percent, 0, 100) if known else -1,
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip


def battery_status(s: Snapshot) -> Message:
    """BATTERY_STATUS: the whole pack's voltage in the first cell's place, as recorded."""
    vehicle, battery = s.vehicle, s.battery
    further = s.vehicle.body.next_battery()
    if further is not None:
        return further_battery_status(further)
    known = vehicle.battery_known
    voltages = [65535] * 10
    charge_state = dialect.MAV_BATTERY_CHARGE_STATE_UNHEALTHY
    if known:
        voltages[0] = to_int(battery.voltage_v * 1000.0, 0, MAX_VOLTAGE_MV)
        charge_state = dialect.MAV_BATTERY_CHARGE_STATE_OK + vehicle.failsafe.battery_level
    return dialect.MAVLink_battery_status_message(
        0, 0, 0, 32767, voltages, to_i16(battery.current_a * 100.0) if known else 0,
        to_i32(battery.consumed_mah) if known else 0,
        to_i32(battery.consumed_wh * 36.0) if known else 0,
        to_int(battery.remaining_percent, 0, 100) if known else -1, 0, charge_state,
    )  # fmt: skip


def further_battery_status(battery: FurtherBattery) -> Message:
    """BATTERY_STATUS of a battery beside the first."""
    return dialect.MAVLink_battery_status_message(
        battery.number, battery.function, 0, 32767,
        [to_int(battery.voltage_v * 1000.0, 0, 65534), *[65535] * 9], -1, -1, -1,
        battery.remaining_percent, 0, battery.charge_state,
    )  # fmt: skip


def extended_sys_state(s: Snapshot) -> Message:
    """EXTENDED_SYS_STATE: a copter's VTOL state is always MC."""
    return dialect.MAVLink_extended_sys_state_message(
        dialect.MAV_VTOL_STATE_MC, int(s.vehicle.landed_state)
    )


def system_time(s: Snapshot) -> Message:
    """SYSTEM_TIME: no date before the GPS."""
    return dialect.MAVLink_system_time_message(s.unix_time_us, boot_ms(s))


def autopilot_version(s: Snapshot) -> Message:
    """AUTOPILOT_VERSION."""
    p = s.vehicle.personality
    return dialect.MAVLink_autopilot_version_message(
        p.capabilities, p.flight_sw_version, 0, 0, 0,
        list(p.flight_custom_version.encode("ascii")[:8].ljust(8, b"\0")), [0] * 8, [0] * 8, 0, 0,
        0,
    )  # fmt: skip


def ekf_status_report(s: Snapshot) -> Message:
    """EKF_STATUS_REPORT: the square roots of the test ratios."""
    estimator = s.vehicle.estimator
    bad = 1.0 if estimator.variance else 0.0
    flags = estimator.flags | (dialect.EKF_GPS_GLITCHING if estimator.glitching else 0)
    return dialect.MAVLink_ekf_status_report_message(
        flags, 0.005 + bad, 0.001 + bad + estimator.gps_test_ratio, 0.007, 0.03, 0.0
    )


def servo_output_raw(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: four motors, 1000 at rest; hover is near 1590 as recorded."""
    # Thrust goes with the square of the motor command above idle; hover pins the scale.
    raw = to_u16(1000.0 + 590.0 * math.sqrt(max(s.thrust_over_hover, 0.0)))
    vehicle = s.vehicle
    assert isinstance(vehicle, Copter)
    motors = vehicle.motor_test.outputs_us() if vehicle.motor_test.running else [min(raw, 2000)] * 4
    others = [vehicle.outputs.servos_us.get(output, 0) for output in range(5, 17)]
    return servo_outputs(s, [*motors, *others])


def servo_outputs(s: Snapshot, outputs_us: Sequence[int], rest_us: int = 0) -> Message:
    """SERVO_OUTPUT_RAW of the first outputs; those behind them are at rest."""
    rest = [rest_us] * (OUTPUTS - len(outputs_us))
    return dialect.MAVLink_servo_output_raw_message(
        s.time_boot_us & 0xFFFFFFFF, 0, *outputs_us, *rest
    )


def rc_channels(s: Snapshot) -> Message:
    """RC_CHANNELS."""
    vehicle = s.vehicle
    channels = vehicle.radio.channels(vehicle.now_s)
    return dialect.MAVLink_rc_channels_message(
        boot_ms(s), vehicle.pilot.count, *channels, *([0] * (18 - len(channels))), 255
    )


_AS_IN_MISSION = ("AUTO.LAND", "AUTO.TAKEOFF")
"""Modes in which PX4's mission_mode says "in mission mode", too"""


def mission_current(s: Snapshot) -> Message:
    """MISSION_CURRENT: with ArduPilot home does not count, with PX4 none is 65535."""
    vehicle, plans = s.vehicle, s.vehicle.plans
    rules = vehicle.personality.plan_rules
    flying = vehicle.mode is vehicle.auto
    total = max(len(plans.mission.items) - int(rules.home_first), 0)
    # PX4 counts a mission that it will not fly as none, whatever its length.
    none = not vehicle.auto.has_mission if rules.identified else not total
    state = dialect.MISSION_STATE_NO_MISSION if none else int(plans.state)
    if not rules.identified:
        return dialect.MAVLink_mission_current_message(plans.current, total, state, int(flying))
    message = dialect.MAVLink_mission_current_message(
        plans.current,
        total or 65535,
        state,
        1 if flying or vehicle.mode.spec.name in _AS_IN_MISSION else 2,
    )
    ids = (plans.mission.identity, plans.fence.identity, plans.rally.identity)
    return Extended(message, struct.pack("<III", *ids))


_BREACHES = {0: 0, 1: 2, 8: 1}
"""FENCE_BREACH by FENCE_TYPE bits: none and the heights; all else is the boundary"""


def fence_status(s: Snapshot) -> Message | None:
    """FENCE_STATUS: only with an enabled fence."""
    fence = s.vehicle.fence
    if not fence.enabled:
        return None
    at_ms = round((fence.breached_at_s - s.vehicle.boot_s) * 1000.0) if fence.count else 0
    return dialect.MAVLink_fence_status_message(
        int(fence.breached != 0), min(fence.count, 65535), _BREACHES.get(fence.last_breached, 3),
        max(at_ms, 0), 1,
    )  # fmt: skip


def power_status(_: Snapshot) -> Message:
    """POWER_STATUS: a board at 5 V."""
    return dialect.MAVLink_power_status_message(5000, 0, 0)


def vibration(s: Snapshot) -> Message:
    """VIBRATION: a little while the motors run."""
    z = 0.25 if s.thrust_over_hover > 0.0 else 0.003
    return dialect.MAVLink_vibration_message(s.time_boot_us, 0.003, 0.003, z, 0, 0, 0)
