"""POSITION_TARGET_*: the echo of GUIDED's target."""

from __future__ import annotations

from mavlink_sitl.autopilot.ardupilot.copter.copter import Copter
from mavlink_sitl.autopilot.ardupilot.copter.guided import Submode
from mavlink_sitl.exchange import Vector
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms, place_e7

_MASKS = {
    Submode.TAKEOFF: 0x0DF8,
    Submode.POSITION: 0x0DF8,
    Submode.POSITION_VELOCITY: 0x0C00,
    Submode.VELOCITY: 0x0C07,
    Submode.ACCELERATION: 0x0C3F,
}
"""type_mask per submode, as recorded; position with velocity by the same pattern"""

_GLOBAL_MASK = 0xFDF8


def position_target_local_ned(s: Snapshot) -> Message | None:
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
        boot_ms(s),
        dialect.MAV_FRAME_LOCAL_NED,
        _MASKS[vehicle.guided.submode],
        *position,
        *(target.velocity_m_s or zero),
        *(target.acceleration_m_s2 or zero),
        0.0,
        0.0,
    )


def position_target_global_int(s: Snapshot) -> Message | None:
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
        boot_ms(s),
        dialect.MAV_FRAME_GLOBAL,
        _GLOBAL_MASK,
        *place_e7(point),
        point.altitude_amsl_m,
        *[0.0] * 8,
    )
