"""Routes an ArduPilot's messages to links by MAVLink's routing rules.

Measured with the real firmware on two links: a COMMAND_ACK, the requests of an upload and its
MISSION_ACK go only where their target was heard; SET_MODE, which names no component, is handed
on to a link on which a component of the same system was heard; telemetry goes out everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence

from mavlink_sitl.mavlink.codec import Message

_AUTOPILOT = 1
_NO_FURTHER = frozenset(("RADIO", "RADIO_STATUS", "SETUP_SIGNING"))
"""Messages that are never forwarded to another link, whatever their target"""


class Routes:
    """The links on which each sender was heard.

    Args:
        system_id: our own.
        links: how many there are.
    """

    def __init__(self, system_id: int, links: int) -> None:
        self._system_id = system_id
        self._all: Sequence[int] = range(links)
        self._heard: dict[tuple[int, int], int] = {}

    def to(self, message: Message) -> Sequence[int]:
        """The links for a message of our own."""
        target = getattr(message, "target_system", 0)
        if len(self._all) == 1 or not target:
            return self._all
        place = self._heard.get((target, message.target_component))
        return self._all if place is None else (place,)

    def hand_on(self, message: Message, place: int) -> list[int]:
        """Learn the link of the sender, and return the other links to forward the message to."""
        if len(self._all) == 1:
            return []
        sender = (message.get_srcSystem(), message.get_srcComponent())
        if sender == (self._system_id, _AUTOPILOT):
            return []
        self._heard[sender] = place
        if message.get_type() in _NO_FURTHER:
            return []
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        if system == 0:
            return [other for other in self._all if other != place]
        found = {
            where
            for (heard, part), where in self._heard.items()
            if heard == system and component in (0, part)
        }
        return sorted(found - {place})
