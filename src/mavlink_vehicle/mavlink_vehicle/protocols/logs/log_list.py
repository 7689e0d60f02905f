"""Lists the autopilot's own logs: LOG_REQUEST_LIST, answered by one LOG_ENTRY for each.

The whole list is always asked for. ArduPilot counts its logs from 1 and PX4 from 0; asked for a
number beyond its last, an ArduPilot would count on from there (AP_Logger_MAVLinkLogTransfer.cpp).
An ArduPilot without logs answers with one entry that says so; a PX4 does not answer.
"""

from __future__ import annotations

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.logs.log_parts import LogLister
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox

_ENTRY = mavlink.MAVLink_log_entry_message
# Not before an ArduPilot has finished its answer: it reports a request during one as an error.
_AGAIN_S = 1.5
_ATTEMPTS = 8
_TO_THE_LAST = 0xFFFF


class LogList(LogLister, TimedOutbox):
    """Asks for the list until it is complete."""

    def __init__(self, address: Address) -> None:
        """Prepare; `start` asks."""
        super().__init__()
        self._address = address
        self._found: dict[int, StoredLog] = {}
        self._count: int | None = None
        self._attempts = 0

    def start(self, now: float) -> None:
        """Ask for the list."""
        self._attempts += 1
        self.deadline_s = now + _AGAIN_S
        target = self._address
        self.outbox.append(
            make(
                "LOG_REQUEST_LIST",
                target_system=target.target_system,
                target_component=target.target_component,
                start=0,
                end=_TO_THE_LAST,
            )
        )

    def receive(self, message: Message, now: float) -> None:
        """Take a LOG_ENTRY."""
        if message.__class__ is not _ENTRY or self.deadline_s is None:
            return
        if message.num_logs != self._count:
            # One was added or erased; the numbers may mean other logs now.
            self._count = message.num_logs
            self._found.clear()
        self.deadline_s = now + _AGAIN_S
        if message.num_logs:
            log = StoredLog(message.id, message.size, message.time_utc)
            if log.log_id not in self._found:
                self._attempts = 1
            self._found[log.log_id] = log
        if len(self._found) >= message.num_logs:
            self.logs = dict(sorted(self._found.items()))
            self.deadline_s = None

    def _on_deadline(self, now: float) -> None:
        """Ask again, or give up."""
        if self._attempts < _ATTEMPTS:
            self.start(now)
            return
        self.deadline_s = None
        known = f"{len(self._found)} of {self._count} entries came" if self._count else "no answer"
        self.problem = (
            f"The autopilot did not list its logs ({known} after {_ATTEMPTS} requests). "
            "A PX4 without logs does not answer."
        )
