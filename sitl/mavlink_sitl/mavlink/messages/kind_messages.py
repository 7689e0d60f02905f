"""Telemetry of each kind of vehicle, where they differ: targets, servos, airspeed."""

from __future__ import annotations

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.copter.guided import Submode
from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane
from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.exchange import Vector
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages import position_messages as position
from mavlink_sitl.mavlink.messages.snapshot import (
    Builder,
    Snapshot,
    boot_ms,
    never,
    place_e7,
    to_i16,
    to_u16,
)
from mavlink_sitl.mavlink.messages.status_messages import servo_outputs

_MASKS = {
    Submode.TAKEOFF: 0x0DF8,
    Submode.POSITION: 0x0DF8,
    Submode.POSITION_VELOCITY: 0x0C00,
    Submode.VELOCITY: 0x0C07,
    Submode.ACCELERATION: 0x0C3F,
}
"""type_mask per submode, as recorded; position with velocity by the same pattern"""

_GLOBAL_MASK = 0xFDF8


def guided_target_local_ned(s: Snapshot) -> Message | None:
    """POSITION_TARGET_LOCAL_NED: only in GUIDED, and not while an attitude is flown."""
    vehicle = s.vehicle
    assert isinstance(vehicle, Copter)
    if vehicle.mode is not vehicle.guided:
        return None
    zero = (0.0, 0.0, 0.0)
    target = vehicle.guided.target
    position = target.position_m or zero
    if vehicle.guided.submode is Submode.POSITION_VELOCITY:
        position = vehicle.body.moving_target()
    return dialect.MAVLink_position_target_local_ned_message(
        boot_ms(s), dialect.MAV_FRAME_LOCAL_NED, _MASKS[vehicle.guided.submode], *position,
        *(target.velocity_m_s or zero), *(target.acceleration_m_s2 or zero), 0.0, 0.0,
    )  # fmt: skip


def guided_target_global_int(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: only in GUIDED towards a position."""
    vehicle = s.vehicle
    assert isinstance(vehicle, Copter)
    if vehicle.mode is not vehicle.guided or vehicle.guided.submode is not Submode.POSITION:
        return None
    target = vehicle.guided.target.position_m or (0.0, 0.0, 0.0)
    return global_target(s, target)


def global_target(s: Snapshot, place_ned_m: Vector) -> Message:
    """POSITION_TARGET_GLOBAL_INT of a place in the local frame, and nothing else."""
    point = s.vehicle.navigator.frame.to_geodetic(*place_ned_m)
    return dialect.MAVLink_position_target_global_int_message(
        boot_ms(s), dialect.MAV_FRAME_GLOBAL, _GLOBAL_MASK, *place_e7(point), point.altitude_amsl_m,
        *[0.0] * 8,
    )  # fmt: skip


def nav_controller_output(s: Snapshot) -> Message | None:
    """NAV_CONTROLLER_OUTPUT: absent in MANUAL, and in all modes that a pilot drives."""
    assert isinstance(s.vehicle, (Rover, Plane))
    report = s.vehicle.navigation_report()
    if report is None:
        return None
    return dialect.MAVLink_nav_controller_output_message(
        report.roll_deg, report.pitch_deg, to_i16(report.bearing_deg),
        to_i16(report.target_bearing_deg), to_u16(report.distance_m), report.altitude_error_m,
        report.airspeed_error_m_s * 100.0, report.cross_track_m,
    )  # fmt: skip


def position_target_global_int(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: in modes that are going somewhere."""
    assert isinstance(s.vehicle, (Rover, Plane))
    destination = s.vehicle.destination_ned_m()
    if destination is None:
        return None
    return global_target(s, destination)


def servo_output_raw(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: steering on 1 and throttle on 3, or a plane's four surfaces."""
    own = dict(enumerate(s.vehicle.body.servos_us(), 1))
    given = {**own, **s.vehicle.outputs.servos_us}
    return servo_outputs(s, [given.get(output, 0) for output in range(1, 17)])


def vfr_hud(s: Snapshot) -> Message:
    """VFR_HUD, with the airspeed where the vehicle has a sensor for it."""
    speed = s.motion.speed_m_s
    airspeed = speed if s.airspeed_m_s is None else s.airspeed_m_s
    return position.hud(s, airspeed, s.throttle_fraction)


def extended_sys_state(s: Snapshot) -> Message:
    """EXTENDED_SYS_STATE: never a VTOL."""
    return dialect.MAVLink_extended_sys_state_message(
        dialect.MAV_VTOL_STATE_UNDEFINED, int(s.vehicle.landed_state)
    )


_COPTER: dict[int, Builder] = {85: guided_target_local_ned, 87: guided_target_global_int}
_OTHERS: dict[int, Builder] = {
    36: servo_output_raw,
    62: nav_controller_output,
    74: vfr_hud,
    85: never,
    87: position_target_global_int,
    245: extended_sys_state,
}
_DRIVEN = {**_OTHERS, 168: never}
"""Without an airspeed there is no estimate of the wind"""
OWN: dict[str, dict[int, Builder]] = {
    "copter": _COPTER,
    "rover": _DRIVEN,
    "boat": _DRIVEN,
    "plane": _OTHERS,
}
"""By vehicle type and message id"""
