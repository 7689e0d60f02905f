"""A MAVLink camera beside a PX4.

By the camera protocol (https://mavlink.io/en/services/camera.html), not by a recording.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.messages import payload_messages
from mavlink_sitl.mavlink.messages.position_messages import quaternion
from mavlink_sitl.mavlink.messages.snapshot import Builder, Snapshot, boot_ms
from mavlink_sitl.mavlink.px4.component import Component

INFORMATION, SETTINGS, CAPTURE_STATUS, IMAGE_CAPTURED = 259, 260, 262, 263


def image_captured(s: Snapshot) -> Message:
    """CAMERA_IMAGE_CAPTURED of the last photo."""
    navigator, number = s.vehicle.navigator, s.vehicle.payload.photos - 1
    latitude, longitude, altitude_m = navigator.here()
    heights_mm = round(altitude_m * 1e3), round(navigator.height_above_home_m() * 1e3)
    return dialect.MAVLink_camera_image_captured_message(
        boot_ms(s), s.unix_time_us, 0, round(latitude * 1e7), round(longitude * 1e7), *heights_mm,
        quaternion(s.motion), number, 1, b"",
    )  # fmt: skip


class CameraComponent(Component):
    """The camera on one link."""

    number, kind = dialect.MAV_COMP_ID_CAMERA, dialect.MAV_TYPE_CAMERA
    builders: ClassVar[Mapping[int, Builder]] = {
        INFORMATION: payload_messages.camera_information,
        SETTINGS: payload_messages.camera_settings,
        CAPTURE_STATUS: payload_messages.camera_capture_status,
        IMAGE_CAPTURED: image_captured,
    }
    requests: ClassVar[Mapping[int, int]] = {
        **Component.requests,
        dialect.MAV_CMD_REQUEST_CAMERA_INFORMATION: INFORMATION,
        dialect.MAV_CMD_REQUEST_CAMERA_SETTINGS: SETTINGS,
        dialect.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: CAPTURE_STATUS,
    }

    def carry_out(self, message: Message) -> Result:
        """IMAGE_START_CAPTURE and IMAGE_STOP_CAPTURE."""
        if message.command == dialect.MAV_CMD_IMAGE_STOP_CAPTURE:
            return self.payload.stop_capture()
        if message.command != dialect.MAV_CMD_IMAGE_START_CAPTURE:
            return Result.UNSUPPORTED
        interval_s, count, number = message.param2, message.param3, message.param4
        if not (math.isfinite(interval_s) and interval_s >= 0.0 and 0.0 <= count < math.inf):
            return Result.DENIED
        return self.payload.start_capture(interval_s, int(count), number)
