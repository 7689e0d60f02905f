"""PX4's telemetry of rovers and boats where it differs from a multicopter's.

Their modules publish no setpoints of attitude and local position, so ATTITUDE_TARGET and
POSITION_TARGET_LOCAL_NED can be asked for, and never come.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_sitl.autopilot.px4.rover_modes import DriveMode
from mavlink_sitl.geodesy import to_geodetic
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.px4 import messages
from mavlink_sitl.mavlink.snapshot import Snapshot, boot_ms, to_i32

Builder = Callable[[Snapshot], Message | list[Message] | None]
DISARMED_US = 900


def drive_outputs(s: Snapshot) -> Message:
    """SERVO_OUTPUT_RAW: steering on 1 and throttle on 2."""
    outputs = [DISARMED_US] * 2
    if s.copter.armed:
        steering, _, throttle, _ = s.instruments.servos_us()
        outputs = [steering, throttle]
    return dialect.MAVLink_servo_output_raw_message(
        s.time_boot_us & 0xFFFFFFFF, 0, *outputs, *[DISARMED_US] * 14
    )


def drive_target(s: Snapshot) -> Message | None:
    """POSITION_TARGET_GLOBAL_INT: where an AUTO mode drives to; no velocities."""
    vehicle = messages.copter_of(s)
    mode = vehicle.flying_mode
    if not (isinstance(mode, DriveMode) and mode.way and vehicle.armed):
        return None
    point = to_geodetic(vehicle.navigator.origin, *mode.way.target, s.motion.down_m)
    return dialect.MAVLink_position_target_global_int_message(
        boot_ms(s),
        5,
        0,
        to_i32(point.latitude_deg * 1e7),
        to_i32(point.longitude_deg * 1e7),
        point.altitude_amsl_m,
        *[0.0] * 8,
    )


def never(_: Snapshot) -> None:
    """Accepted when asked for, and never sent."""
    return


_DRIVE: dict[int, Builder] = {
    36: drive_outputs,
    83: never,
    85: never,
    87: drive_target,
}
BUILDERS: dict[str, dict[int, Builder]] = {
    "px4copter": messages.BUILDERS,
    "px4rover": {**messages.BUILDERS, **_DRIVE},
    "px4boat": {**messages.BUILDERS, **_DRIVE},
}
"""By kind of vehicle and message id"""
