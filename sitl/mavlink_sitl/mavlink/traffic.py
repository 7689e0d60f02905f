"""Other aircraft that the vehicle's ADS-B receiver hears: ADSB_VEHICLE in, and out again.

The receiver is any component that sends ADSB_VEHICLE to the autopilot, as a pingRX does.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from mavlink_sitl.autopilot.parameters import Parameters
from mavlink_sitl.mavlink.codec import Message, dialect

ADSB_VEHICLE = 246
_LIST_US, _TIMEOUT_US = 1_000_000, 5_000_000
_LIST_MAX, _QUEUE_MAX = 25, 100


class TrafficList:
    """The list of an ArduPilot (AP_ADSB.cpp).

    It has a place for each ICAO address, takes nothing while ADSB_TYPE is 0, and is sent one
    aircraft at a time, at the interval that was asked for: from its beginning once a second at
    most.
    """

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._heard: dict[int, tuple[Message, int]] = {}
        self._left: list[int] = []
        self._begun_us = -_LIST_US

    def take(self, message: Message, now_us: int) -> None:
        """Process ADSB_VEHICLE."""
        on = "ADSB_TYPE" in self._parameters and bool(self._parameters["ADSB_TYPE"])
        known = message.ICAO_address in self._heard
        if on and (known or len(self._heard) < _LIST_MAX):
            self._heard[message.ICAO_address] = (_copied(message), now_us)

    def due(self, now_us: int) -> list[Message]:
        """Return the reports to send when the stream is due."""
        self._heard = {
            address: heard
            for address, heard in self._heard.items()
            if now_us - heard[1] <= _TIMEOUT_US
        }
        if not self._left and now_us - self._begun_us >= _LIST_US:
            self._begun_us, self._left = now_us, list(self._heard)
        while self._left:
            heard = self._heard.get(self._left.pop(0))
            if heard is not None:
                return [heard[0]]
        return []


class TrafficQueue:
    """The reports of a PX4 (transponder_report), each of which every link sends once.

    A link sends them as they come, unless it was asked for another interval.
    """

    def __init__(self, send: Callable[[Message], None], streams: Callable[[], bool]) -> None:
        """Prepare.

        Args:
            send: sends a message on the link.
            streams: whether the link sends them at an interval.
        """
        self._send = send
        self._streams = streams
        self._queue: deque[Message] = deque(maxlen=_QUEUE_MAX)

    def take(self, message: Message, now_us: int) -> None:
        """Process ADSB_VEHICLE."""
        self._queue.append(_copied(message))
        if not self._streams():
            for report in self.due(now_us):
                self._send(report)

    def due(self, now_us: int) -> list[Message]:
        """Return the reports to send when the stream is due."""
        reports = list(self._queue)
        self._queue.clear()
        return reports


def _copied(message: Message) -> Message:
    values = {name: getattr(message, name) for name in message.get_fieldnames()}
    values["callsign"] = message.callsign.encode("ascii", "replace")
    return dialect.MAVLink_adsb_vehicle_message(**values)
