"""Commands and messages of a PX4 with a gimbal, recorded of PX4 1.17 with its gimbal module."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar

from mavlink_sitl.autopilot.px4.payload import (
    LIMITS_DEG,
    MAVLINK_GIMBAL,
    SERVOS,
    Px4Payload,
    upright,
)
from mavlink_sitl.autopilot.px4.vehicle import Px4Vehicle
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages.position_messages import quaternion_of
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot, boot_ms
from mavlink_sitl.mavlink.px4.component import Component
from mavlink_sitl.mavlink.setpoints import usable

if TYPE_CHECKING:
    from mavlink_sitl.mavlink.px4.server import Px4Server
    from mavlink_sitl.mavlink.received_command import ReceivedCommand

CAPABILITIES, OF_DEVICE = 132530, 0x7FF
"""Of servos; of a gimbal with MAVLink: all that the protocol has but endless turns"""
IN_VEHICLE = 32
"""GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME"""
REPORT_US = 200_000
"""A gimbal with MAVLink reports its attitude itself"""
DEVICE_INFORMATION = 283
MOUNT_ORIENTATION, MANAGER_INFORMATION, MANAGER_STATUS, ATTITUDE_STATUS = 265, 280, 281, 285
GIMBAL_HZ = {MOUNT_ORIENTATION: 10.0, MANAGER_STATUS: 0.5, ATTITUDE_STATUS: 1.0}
"""Streams of both kinds of links, where the device is the autopilot's matter"""
_NAN = math.nan


def payload_of(s: Snapshot) -> Px4Payload:
    """The gimbal."""
    vehicle = s.vehicle
    if not isinstance(vehicle, Px4Vehicle):
        raise TypeError(f"no gimbal of a PX4 in {type(vehicle).__name__}")
    return vehicle.payload


def manager_information(s: Snapshot) -> Message:
    """GIMBAL_MANAGER_INFORMATION: as the real one, of servos with the whole ranges in degrees.

    Of a gimbal with MAVLink these are its own limits, in radians, without those of roll.
    """
    values = s.vehicle.parameters
    if payload_of(s).device == SERVOS:
        pitch, yaw = values["MNT_RANGE_PITCH"], values["MNT_RANGE_YAW"]
        limits = [-pitch, pitch, -yaw, yaw]
    else:
        limits = [math.radians(each) for axis in ("PITCH", "YAW") for each in LIMITS_DEG[axis]]
    device = payload_of(s).device
    capabilities = CAPABILITIES if device == SERVOS else OF_DEVICE
    return dialect.MAVLink_gimbal_manager_information_message(
        boot_ms(s), capabilities, device, 0.0, 0.0, *limits
    )


def manager_status(s: Snapshot) -> Message:
    """GIMBAL_MANAGER_STATUS."""
    payload = payload_of(s)
    return dialect.MAVLink_gimbal_manager_status_message(
        boot_ms(s), _flags(payload), payload.device, *payload.control, 0, 0
    )


def attitude_status(s: Snapshot) -> Message:
    """GIMBAL_DEVICE_ATTITUDE_STATUS: the servos' angles, without a flag for a frame."""
    payload = payload_of(s)
    angles = payload.roll_deg, payload.pitch_deg, payload.yaw_deg
    return dialect.MAVLink_gimbal_device_attitude_status_message(
        0, 0, boot_ms(s), _flags(payload), quaternion_of(*map(math.radians, angles)),
        0.0, 0.0, 0.0, 0, 0.0, 0.0, payload.device if payload.device == SERVOS else 0,
    )  # fmt: skip


def mount_orientation(s: Snapshot) -> Message:
    """MOUNT_ORIENTATION."""
    payload = payload_of(s)
    absolute_deg = (payload.yaw_deg + math.degrees(s.motion.yaw_rad)) % 360.0
    return dialect.MAVLink_mount_orientation_message(
        boot_ms(s), payload.roll_deg, payload.pitch_deg, payload.yaw_deg, absolute_deg
    )


def _information(s: Snapshot, device: int) -> Message:
    limits = [math.radians(each) for axis in ("ROLL", "PITCH", "YAW") for each in LIMITS_DEG[axis]]
    return dialect.MAVLink_gimbal_device_information_message(
        boot_ms(s), *[b""] * 3, 0, 0, 0, OF_DEVICE, 0, *limits, device
    )


def device_information(s: Snapshot) -> Message:
    """GIMBAL_DEVICE_INFORMATION of the gimbal with MAVLink about itself."""
    return _information(s, 0)


def handed_on_information(s: Snapshot) -> Message:
    """The same, as the autopilot answers for it."""
    return _information(s, MAVLINK_GIMBAL)


_OF_MANAGER: dict[int, Builder] = {
    MANAGER_INFORMATION: manager_information,
    MANAGER_STATUS: manager_status,
}
BUILDERS: dict[int, dict[int, Builder]] = {
    0: {},
    SERVOS: {
        **_OF_MANAGER,
        MOUNT_ORIENTATION: mount_orientation,
        ATTITUDE_STATUS: attitude_status,
    },
    MAVLINK_GIMBAL: {**_OF_MANAGER, DEVICE_INFORMATION: handed_on_information},
}
"""Of the autopilot, by the gimbal's device"""


class GimbalComponent(Component):
    """A gimbal with MAVLink on one link: it reports its attitude unasked."""

    number, kind = MAVLINK_GIMBAL, dialect.MAV_TYPE_GIMBAL
    builders: ClassVar[Mapping[int, Builder]] = {
        DEVICE_INFORMATION: device_information,
        ATTITUDE_STATUS: attitude_status,
    }
    _report_at_us = 0

    def tick(self, now_us: int) -> None:
        """Send what is due."""
        super().tick(now_us)
        if now_us >= self._report_at_us:
            self._report_at_us = now_us + REPORT_US
            self.send(ATTITUDE_STATUS)
        self.due_us = min(self.due_us, self._report_at_us)


def _flags(payload: Px4Payload) -> int:
    """Only the gimbal with MAVLink says that its yaw is from the nose."""
    return payload.flags | (IN_VEHICLE if payload.device == MAVLINK_GIMBAL else 0)


def _angles_deg(q: list[float]) -> tuple[float, float, float]:
    w, x, y, z = q
    sine = max(-1.0, min(1.0, 2.0 * (w * y - z * x)))
    return (
        math.degrees(math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))),
        math.degrees(math.asin(sine)) if math.isfinite(sine) else _NAN,
        math.degrees(math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))),
    )


# Commands. Without a gimbal nobody answers the first three.


def configure(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """DO_GIMBAL_MANAGER_CONFIGURE."""
    payload = server.vehicle.payload
    if not payload.has_gimbal:
        return None
    return payload.configure_for(command.params[:2], server.asker)


def point(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """DO_GIMBAL_MANAGER_PITCHYAW."""
    payload = server.vehicle.payload
    if not payload.has_gimbal:
        return None
    pitch_deg, yaw_deg, *rates = command.params
    flags = int(command.x) if usable(command.x) else 0
    return payload.point_from(
        upright(pitch_deg, yaw_deg), (rates[0], rates[1]), flags, server.asker
    )


def mount(server: Px4Server, command: ReceivedCommand) -> Result | None:
    """DO_MOUNT_CONTROL."""
    payload = server.vehicle.payload
    if not payload.has_gimbal:
        return None
    pitch_deg, roll_deg, yaw_deg, _ = command.params
    return payload.mount(command.z, (roll_deg, pitch_deg, yaw_deg))


def on_set_attitude(server: Px4Server, message: Message) -> None:
    """GIMBAL_MANAGER_SET_ATTITUDE."""
    rates = (message.angular_velocity_y, message.angular_velocity_z)
    _set(server, message.flags, _angles_deg(message.q), rates)


def on_manual_control(server: Px4Server, message: Message) -> None:
    """GIMBAL_MANAGER_SET_MANUAL_CONTROL: angles in radians, rates as shares of MNT_RATE_*."""
    values = server.vehicle.parameters
    rates = (
        message.pitch_rate * math.radians(values["MNT_RATE_PITCH"]),
        message.yaw_rate * math.radians(values["MNT_RATE_YAW"]),
    )
    angles = upright(math.degrees(message.pitch), math.degrees(message.yaw))
    _set(server, message.flags, angles, rates)


def _set(
    server: Px4Server,
    flags: int,
    angles_deg: tuple[float, float, float],
    rates_rad_s: tuple[float, float],
) -> None:
    payload = server.vehicle.payload
    if payload.has_gimbal:
        pitch, yaw = map(math.degrees, rates_rad_s)
        payload.point_from(angles_deg, (pitch, yaw), flags, server.asker)
