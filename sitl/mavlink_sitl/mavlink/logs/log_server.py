"""The log service: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END, LOG_ERASE.

https://mavlink.io/en/messages/common.html#LOG_REQUEST_LIST; the rules are those of
AP_Logger_MAVLinkLogTransfer.cpp and mavlink_log_handler.cpp.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_sitl.autopilot.common.commander import Commander
from mavlink_sitl.exchange import Severity
from mavlink_sitl.mavlink.codec import Message, dialect
from mavlink_sitl.mavlink.logs.logbook import Logbook
from mavlink_sitl.mavlink.messages.streams import NEVER_US

STEP_US = 10_000
PACKETS_PER_STEP = 20
_PACKET_BYTES = 90
_U32_MAX = 2**32 - 1


class LogServer:
    """Gives one vehicle's logs away on one link, as an ArduPilot does.

    Logs are counted from 1. While armed nothing is answered. A request during the answer to
    another is ignored; about a list there is a text.

    Attributes:
        handlers: by the name of the message.
    """

    first_id = 1

    def __init__(
        self, logbook: Logbook, vehicle: Commander, send: Callable[[Message], None]
    ) -> None:
        self._logbook = logbook
        self._vehicle = vehicle
        self._send = send
        self._to_list: list[int] = []
        self._last_listed = 0
        self._reading: tuple[int, int, int] | None = None
        """Number of the log, offset of the next byte, and of the end of what was asked for"""
        self._due_us = NEVER_US
        self._said_armed = False
        self.handlers: dict[str, Callable[[Message], None]] = {
            "LOG_REQUEST_LIST": self._on_list,
            "LOG_REQUEST_DATA": self._on_data,
            "LOG_REQUEST_END": self._on_end,
            "LOG_ERASE": self._on_erase,
        }

    @property
    def busy(self) -> bool:
        """Whether a request is being answered."""
        return bool(self._to_list) or self._reading is not None

    def next_due_us(self) -> int:
        """The time at which `tick` has something to do."""
        return self._due_us

    def tick(self, now_us: int) -> None:
        """Send the next part of an answer."""
        self._due_us = now_us + STEP_US if self.busy else NEVER_US
        if not self.silent:
            for _ in range(PACKETS_PER_STEP):
                self._send_next()

    @property
    def silent(self) -> bool:
        """Whether nothing is answered now."""
        return self._vehicle.armed

    def receive(self, message: Message, now_us: int) -> None:
        """Process a request."""
        if self.silent:
            if not self._said_armed:
                self._vehicle.say(Severity.ERROR, "Disarm for log download")
            self._said_armed = True
            return
        self._said_armed = False
        self.handlers[message.get_type()](message)
        if self.busy:
            self._due_us = min(self._due_us, now_us)

    def _send_next(self) -> None:
        if self._to_list:
            self._send_entry(self._to_list.pop(0))
        elif self._reading is not None:
            self._send_data(*self._reading)

    def _send_entry(self, log_id: int) -> None:
        logs = self._logbook.logs
        place = log_id - self.first_id
        size, time_s = 0, 0
        if 0 <= place < len(logs):
            size, time_s = len(logs[place].data), min(logs[place].begun_unix_s, _U32_MAX)
        self._send(
            dialect.MAVLink_log_entry_message(log_id, len(logs), self._last_listed, time_s, size)
        )

    def _send_data(self, log_id: int, offset: int, end: int) -> None:
        log = self._logbook.logs[log_id - self.first_id]
        data = bytes(log.data[offset : min(offset + _PACKET_BYTES, self._clip(end, len(log.data)))])
        padded = [*data, *bytes(_PACKET_BYTES - len(data))]
        self._send(dialect.MAVLink_log_data_message(log_id, offset, len(data), padded))
        offset += len(data)
        ended = offset >= min(end, len(log.data)) or len(data) < _PACKET_BYTES
        self._reading = None if ended else (log_id, offset, end)

    def _clip(self, end: int, size: int) -> int:
        """Where an answer ends, at the latest."""
        return min(end, size)

    def _on_list(self, message: Message) -> None:
        if self.busy:
            self._vehicle.say(Severity.INFO, "Log download in progress")
            return
        count = len(self._logbook.logs)
        self._last_listed = min(message.end, count)
        # Without a log one entry says so.
        first = max(message.start, 1) if count else 0
        self._to_list = list(range(first, self._last_listed + 1))

    def _on_data(self, message: Message) -> None:
        if self.busy or not self._exists(message.id):
            return
        self._reading = (message.id, message.ofs, min(message.ofs + message.count, _U32_MAX))

    def _exists(self, log_id: int) -> bool:
        return 0 <= log_id - self.first_id < len(self._logbook.logs)

    def _on_end(self, message: Message) -> None:
        self._to_list.clear()
        self._reading = None

    def _on_erase(self, message: Message) -> None:
        self._on_end(message)
        self._logbook.erase()


class Px4LogServer(LogServer):
    """The same of a PX4.

    Logs are counted from 0, and given while armed, too. A new request takes the place of the one
    that is being answered. Data come only after a list, the last packet of an answer is full even
    if less was asked for, and without a log there is no entry.
    """

    first_id = 0

    def __init__(
        self, logbook: Logbook, vehicle: Commander, send: Callable[[Message], None]
    ) -> None:
        super().__init__(logbook, vehicle, send)
        self._listed = 0

    @property
    def silent(self) -> bool:
        """Whether nothing is answered now."""
        return False

    def _clip(self, end: int, size: int) -> int:
        return size

    def _on_list(self, message: Message) -> None:
        self._on_end(message)
        count = self._listed = len(self._logbook.logs)
        self._last_listed = count if message.end == 0xFFFF else message.end
        self._to_list = list(range(message.start, count))

    def _on_data(self, message: Message) -> None:
        self._on_end(message)
        if message.id >= self._listed or not self._exists(message.id):
            return
        if message.ofs < len(self._logbook.logs[message.id].data):
            self._reading = (message.id, message.ofs, min(message.ofs + message.count, _U32_MAX))

    def _on_erase(self, message: Message) -> None:
        super()._on_erase(message)
        self._listed = 0
