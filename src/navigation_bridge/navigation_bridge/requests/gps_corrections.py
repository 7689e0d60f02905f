"""RTCM corrections of clients for the vehicle's GPS. No ROS."""

from __future__ import annotations

from mavlink_vehicle.protocols.streams.rtcm import RtcmError
from navigation_bridge.requests.feature import Feature

__all__ = ["GpsCorrections"]


class GpsCorrections(Feature):
    """Sends corrections to the vehicle."""

    def send(self, data: bytes, now: float) -> None:
        """Send RTCM corrections to the vehicle.

        Args:
            data: whole RTCM 3 messages, one after the other.
            now: time in seconds.

        Raises:
            RtcmError: they are not sent, and why.
        """
        if self.parts.unreached:
            raise RtcmError(self.parts.unreached)
        self.parts.vehicle.rtcm.offer(data, now)
