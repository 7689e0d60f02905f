"""Routes an ArduPilot's messages to links by MAVLink's routing rules.

Measured with the real firmware on two links: a COMMAND_ACK, the requests of an upload and its
MISSION_ACK go only where their target was heard; SET_MODE, which names no component, is handed
on to a link on which a component of the same system was heard; telemetry goes out everywhere.

A serial port with bit 10 of SERIALn_OPTIONS is private: nothing from it is handed on, and to it
only what names a component that was heard there (MAVLink_routing.cpp).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.mavlink.codec import Message

_AUTOPILOT = 1
_NO_FURTHER = frozenset(("RADIO", "RADIO_STATUS", "SETUP_SIGNING"))
"""Messages that are never forwarded to another link, whatever their target"""

_PRIVATE = 1 << 10


def private_links(parameters: Parameters, count: int) -> list[int]:
    """Return which of the first links are private, by the parameters at power-up."""
    names = [f"SERIAL{place}_OPTIONS" for place in range(count)]
    known = [(place, name) for place, name in enumerate(names) if name in parameters]
    return [place for place, name in known if int(parameters[name]) & _PRIVATE]


class Routes:
    """The links on which each sender was heard.

    Args:
        system_id: our own.
        links: how many there are.
        private: those that are private.
    """

    def __init__(self, system_id: int, links: int, private: Collection[int] = ()) -> None:
        self._system_id = system_id
        self._private = private
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
        if message.get_type() in _NO_FURTHER or place in self._private:
            return []
        system = getattr(message, "target_system", 0)
        component = getattr(message, "target_component", 0)
        if system == 0:
            return [one for one in self._all if one != place and one not in self._private]
        found = {
            where
            for (heard, part), where in self._heard.items()
            if heard == system
            and (component == part or (component == 0 and where not in self._private))
        }
        return sorted(found - {place})
