"""Sends what cameras see of the mark, as a program that finds marks in pictures does."""

from __future__ import annotations

import math

from mavlink_sitl.exchange import Sighting
from mavlink_sitl.links.addresses import LinkAddress
from mavlink_sitl.links.endpoints import LinkError, OpenLink, open_endpoint
from mavlink_sitl.mavlink.codec import Encoder, dialect

__all__ = ["CameraSender", "LinkError"]

_COMPONENT = 100
"""MAV_COMP_ID_CAMERA"""
_FRAME = 12
"""MAV_FRAME_BODY_FRD"""
_TYPE = 2
"""LANDING_TARGET_TYPE_VISION_FIDUCIAL"""


class CameraSender:
    """A link of its own, beside those of the vehicles.

    Args:
        address: where to.

    Raises:
        LinkError: it cannot be opened.
    """

    def __init__(self, address: LinkAddress) -> None:
        self.endpoint: OpenLink = open_endpoint(address, lambda _data, _peer: None)
        self._encoders: dict[int, Encoder] = {}

    def send(self, system_id: int, sighting: Sighting, measured_us: int) -> None:
        """Send LANDING_TARGET.

        Args:
            system_id: of the vehicle that has the camera.
            sighting: what it saw.
            measured_us: time of the picture, microseconds since 1970, UTC.
        """
        forward, right, down = sighting.body_frd_m
        message = dialect.MAVLink_landing_target_message(
            measured_us,
            0,
            _FRAME,
            math.atan2(forward, down),
            math.atan2(right, down),
            math.hypot(forward, right, down),
            0.0,
            0.0,
            forward,
            right,
            down,
            (1.0, 0.0, 0.0, 0.0),
            _TYPE,
            1,
        )
        encoder = self._encoders.setdefault(system_id, Encoder(system_id, _COMPONENT))
        self.endpoint.send(encoder.encode(message))
