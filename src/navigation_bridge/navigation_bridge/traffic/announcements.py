"""Announces the vehicles of the server to an autopilot and its ground stations. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.codec import Message
from navigation_bridge.traffic.other_traffic import address_of, adsb_of, is_by_adsb
from navigation_bridge.traffic.shared_traffic import SharedTraffic

__all__ = ["Announcements"]

_ANNOUNCE_S = 1.0


class Announcements:
    """The messages to one vehicle about the others."""

    def __init__(self) -> None:
        """Begin without any."""
        self._announced_s = -math.inf
        self._messages: list[Message] = []

    def announce(self, shared: SharedTraffic, name: str, now: float) -> None:
        """Announce all but one vehicle, once a second."""
        if shared.earth is None or now - self._announced_s < _ANNOUNCE_S:
            return
        self._announced_s = now
        for other in shared.reservations.others(name):
            if len(other.held) and not is_by_adsb(other.name):
                # An autopilot with a receiver reports it back.
                shared.others.own_addresses.add(address_of(other.name))
                place = shared.earth.geodetic(other.held.points_m[0])
                self._messages.append(adsb_of(other, place))

    def take(self) -> list[Message]:
        """Return and clear the messages."""
        messages, self._messages = self._messages, []
        return messages
