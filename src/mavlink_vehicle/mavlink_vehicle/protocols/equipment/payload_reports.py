"""Reports of a gimbal and of a camera, through the autopilot or by themselves.

https://mavlink.io/en/services/gimbal_v2.html and camera.html; an ArduPilot reports photos of a
camera that it triggers itself by CAMERA_FEEDBACK.
"""

from __future__ import annotations

import math

from mavlink_vehicle.codec import Message, mavlink
from mavlink_vehicle.events import GimbalTurned, PhotoReported
from mavlink_vehicle.positions.frames import yaw_of_quaternion
from mavlink_vehicle.protocols.service import VehicleService

__all__ = ["PayloadReports"]

_ATTITUDE = mavlink.MAVLink_gimbal_device_attitude_status_message
_MANAGER = mavlink.MAVLink_gimbal_manager_status_message
_CAPTURED = mavlink.MAVLink_camera_image_captured_message
_FEEDBACK = mavlink.MAVLink_camera_feedback_message
_IN_EARTH = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_EARTH_FRAME
_IN_VEHICLE = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
_VERTICAL_RAD = math.radians(88.0)
_LOCKED = mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK


class PayloadReports(VehicleService):
    """Reads them.

    Attributes:
        gimbal: the last report of the gimbal; None before the first.
    """

    handles = (_ATTITUDE, _MANAGER, _CAPTURED, _FEEDBACK)
    hears_companions = True

    def __init__(self) -> None:
        """Begin without a report."""
        super().__init__()
        self.gimbal: GimbalTurned | None = None
        self._control = (0, 0)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """Forget what was reported."""
        self.gimbal, self._control = None, (0, 0)

    def receive(self, message: Message, now: float) -> None:
        """Read a message."""
        if isinstance(message, _ATTITUDE):
            self._take_attitude(message, now)
        elif isinstance(message, _MANAGER):
            self._control = (message.primary_control_sysid, message.primary_control_compid)
        elif isinstance(message, _FEEDBACK):
            if message.img_idx:  # one that is asked for before the first photo has number 0
                place = (message.lat * 1e-7, message.lng * 1e-7, message.alt_msl)
                self.events.append(PhotoReported(message.img_idx, True, place))
        elif isinstance(message, _CAPTURED):
            place = (message.lat * 1e-7, message.lon * 1e-7, message.alt * 1e-3)
            taken = message.capture_result == 1
            self.events.append(PhotoReported(max(message.image_index, 0), taken, place))

    def _take_attitude(
        self, message: mavlink.MAVLink_gimbal_device_attitude_status_message, now: float
    ) -> None:
        w, x, y, z = message.q
        if not all(map(math.isfinite, (w, x, y, z))) or w * w + x * x + y * y + z * z < 0.5:
            return
        pitch_rad = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
        yaw_rad = yaw_of_quaternion((w, x, y, z))
        if abs(pitch_rad) > _VERTICAL_RAD:
            # Yaw and roll are the same turn then; a gimbal that keeps the horizon has no roll.
            yaw_rad = math.remainder(2.0 * math.atan2(z, w), math.tau)
        # Older devices set neither flag: a locked yaw is from north then. An autopilot that moves
        # servos itself (a device id) reports what they do, from the nose: so does PX4 1.17.
        neither = not message.flags & (_IN_EARTH | _IN_VEHICLE) and not message.gimbal_device_id
        from_north = bool(message.flags & (_LOCKED if neither else _IN_EARTH))
        self.gimbal = GimbalTurned(now, pitch_rad, yaw_rad, from_north, self._control)
        self.events.append(self.gimbal)
