"""The topic of RTCM corrections for the vehicle's GPS."""

from __future__ import annotations

from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.qos import QoSProfile
from std_msgs.msg import UInt8MultiArray

from drone_navigation.server.bridge_access import BridgeAccess
from mavlink_vehicle.protocols.streams.rtcm import RtcmError
from navigation_bridge.requests.gps_corrections import GpsCorrections

__all__ = ["CorrectionTopic"]

_QOS = QoSProfile(depth=50)
# Corrections come every second; the same rejection is logged this often.
_AGAIN_S = 10.0


class CorrectionTopic:
    """Subscribes to ``~/rtcm`` and passes on what comes, in its order."""

    def __init__(self, access: BridgeAccess) -> None:
        """Subscribe."""
        self._node, self._bridge = access.node, access.bridge
        self._driver, self._clock = access.driver, access.clock
        self._reported_s: dict[str, float] = {}
        self._node.create_subscription(
            UInt8MultiArray,
            "~/rtcm",
            self._hear,
            _QOS,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )

    def _hear(self, message: UInt8MultiArray) -> None:
        data = bytes(message.data)
        self._driver.post(lambda: self._send(data))

    def _send(self, data: bytes) -> None:
        """Send them; on the driver's thread."""
        now = self._clock.now()
        try:
            self._bridge.feature(GpsCorrections).send(data, now)
        except RtcmError as error:
            text = str(error)
            if now - self._reported_s.get(text, -_AGAIN_S) >= _AGAIN_S:
                if len(self._reported_s) > 100:
                    self._reported_s.clear()
                self._reported_s[text] = now
                self._node.get_logger().warning(f"RTCM corrections ignored: {text}")
