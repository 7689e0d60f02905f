"""A MAVLink camera beside a PX4: a component of its own on each link, sans-IO.

By the camera protocol (https://mavlink.io/en/services/camera.html), not by a recording: PX4 hands
on what is sent to this component, and does nothing else with it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from mavlink_sitl.autopilot.px4.payload import Px4Payload
from mavlink_sitl.exchange import Result
from mavlink_sitl.mavlink.codec import Encoder, Message, dialect
from mavlink_sitl.mavlink.messages import payload_messages
from mavlink_sitl.mavlink.messages.position_messages import quaternion
from mavlink_sitl.mavlink.messages.snapshot import Snapshot, boot_ms

COMPONENT = 100
"""MAV_COMP_ID_CAMERA"""
HEARTBEAT_US = 1_000_000
_CAPTURE_STATUS = 262


def image_captured(s: Snapshot, payload: Px4Payload) -> Message:
    """CAMERA_IMAGE_CAPTURED of the last photo."""
    navigator, number = s.vehicle.navigator, payload.photos - 1
    latitude, longitude, altitude_m = navigator.here()
    heights_mm = round(altitude_m * 1e3), round(navigator.height_above_home_m() * 1e3)
    return dialect.MAVLink_camera_image_captured_message(
        boot_ms(s), s.unix_time_us, 0, round(latitude * 1e7), round(longitude * 1e7), *heights_mm,
        quaternion(s.motion), number, 1, b"",
    )  # fmt: skip


class CameraComponent:
    """Speaks for the camera on one link.

    Args:
        system_id: of the vehicle.
        payload: the camera.
        snapshot: what the vehicle would report now.
        send: takes a frame for the link.
        now_us: simulated time.

    Attributes:
        due_us: when `tick` has something to do.
    """

    def __init__(
        self,
        system_id: int,
        payload: Px4Payload,
        snapshot: Callable[[], Snapshot],
        send: Callable[[bytes], None],
        now_us: int,
    ) -> None:
        self._payload = payload
        self._snapshot = snapshot
        self._send_frame = send
        self._encoder = Encoder(system_id, COMPONENT)
        self.due_us = now_us

    def _send(self, message: Message | None) -> None:
        if message is not None:
            self._send_frame(self._encoder.encode(message))

    def tick(self, now_us: int) -> None:
        """Send HEARTBEAT once a second."""
        if now_us >= self.due_us:
            self.due_us += HEARTBEAT_US
            beat = dialect.MAVLink_heartbeat_message
            kind, nobody = dialect.MAV_TYPE_CAMERA, dialect.MAV_AUTOPILOT_INVALID
            self._send(beat(kind, nobody, 0, 0, dialect.MAV_STATE_ACTIVE, 3))

    def send_captured(self) -> None:
        """Report the photo that was just taken."""
        self._send(image_captured(self._snapshot(), self._payload))

    def receive(self, message: Message) -> None:
        """Carry out a command, and answer it."""
        handler = _HANDLERS.get(message.command)
        result = Result.UNSUPPORTED
        if handler is not None:
            result = handler(self, message)
        sender = (message.get_srcSystem(), message.get_srcComponent())
        ack = dialect.MAVLink_command_ack_message
        self._send(ack(message.command, int(result), 0, 0, *sender))
        if result is Result.ACCEPTED and message.command in _REQUESTS:
            number = _REQUESTS[message.command] or int(message.param1)
            self._send(_BUILDERS[number](self._snapshot()))

    def _requested(self, message: Message) -> Result:
        number = _REQUESTS[message.command] or message.param1
        return Result.ACCEPTED if number in _BUILDERS else Result.UNSUPPORTED

    def _start(self, message: Message) -> Result:
        interval_s, count, number = message.param2, message.param3, message.param4
        if not (math.isfinite(interval_s) and interval_s >= 0.0 and 0.0 <= count < math.inf):
            return Result.DENIED
        return self._payload.start_capture(interval_s, int(count), number)

    def _stop(self, _: Message) -> Result:
        return self._payload.stop_capture()


_BUILDERS = {
    259: payload_messages.camera_information,
    260: payload_messages.camera_settings,
    _CAPTURE_STATUS: payload_messages.camera_capture_status,
}
"""By message id: what can be requested"""
_REQUESTS = {
    dialect.MAV_CMD_REQUEST_MESSAGE: 0,
    dialect.MAV_CMD_REQUEST_CAMERA_INFORMATION: 259,
    dialect.MAV_CMD_REQUEST_CAMERA_SETTINGS: 260,
    dialect.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: _CAPTURE_STATUS,
}
"""By command: the message that it requests; 0 for that of its first parameter"""
_HANDLERS: dict[int, Callable[[CameraComponent, Message], Result]] = {
    dialect.MAV_CMD_IMAGE_START_CAPTURE: CameraComponent._start,
    dialect.MAV_CMD_IMAGE_STOP_CAPTURE: CameraComponent._stop,
    **dict.fromkeys(_REQUESTS, CameraComponent._requested),
}
