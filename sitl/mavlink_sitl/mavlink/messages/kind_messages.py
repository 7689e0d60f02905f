"""Telemetry of rovers, boats and planes where it differs from a copter's."""

from __future__ import annotations

from mavlink_sitl.autopilot.ardupilot.plane.plane import Plane
from mavlink_sitl.autopilot.ardupilot.rover.rover import Rover
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages import position_messages as position
from mavlink_sitl.mavlink.messages.guided_target import global_target
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot, never, to_i16, to_u16
from mavlink_sitl.mavlink.messages.status_messages import servo_outputs


def nav_controller_output(s: Snapshot) -> Message | None:
    """NAV_CONTROLLER_OUTPUT: absent in MANUAL, and in all modes that a pilot drives."""
    assert isinstance(s.vehicle, (Rover, Plane))
    report = s.vehicle.navigation_report()
    if report is None:
        return None
    return dialect.MAVLink_nav_controller_output_message(
        report.roll_deg,
        report.pitch_deg,
        to_i16(report.bearing_deg),
        to_i16(report.target_bearing_deg),
        to_u16(report.distance_m),
        report.altitude_error_m,
        report.airspeed_error_m_s * 100.0,
        report.cross_track_m,
    )


def position_target_global_int(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: in modes that are going somewhere."""
    assert isinstance(s.vehicle, (Rover, Plane))
    destination = s.vehicle.destination_ned_m()
    if destination is None:
        return None
    return global_target(s, destination)


def servo_output_raw(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: steering on 1 and throttle on 3, or a plane's four surfaces."""
    own = dict(enumerate(s.instruments.servos_us(), 1))
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


_OWN: dict[int, Builder] = {
    36: servo_output_raw,
    62: nav_controller_output,
    74: vfr_hud,
    85: never,
    87: position_target_global_int,
    245: extended_sys_state,
}

_DRIVEN = {**_OWN, 168: never}
"""Without an airspeed there is no estimate of the wind"""

BY_KIND: dict[str, dict[int, Builder]] = {"rover": _DRIVEN, "boat": _DRIVEN, "plane": _OWN}
"""By vehicle type and message id: what is built another way"""


def for_kinds(message_id: int, builder: Builder) -> Builder:
    """A builder that asks the vehicle's kind first."""
    others = {kind: table[message_id] for kind, table in BY_KIND.items() if message_id in table}
    if not others:
        return builder

    def build(s: Snapshot) -> Message | None:
        return others.get(s.vehicle.personality.kind, builder)(s)

    return build
