"""Downloads one log: LOG_REQUEST_DATA for a span, LOG_DATA with 90 bytes each, gaps again.

One span is asked for at a time, and the next only when the last one has come or stopped coming:
an ArduPilot ignores requests while it answers one, a PX4 drops the one it is answering
(AP_Logger_MAVLinkLogTransfer.cpp, mavlink_log_handler.cpp; both observed). Gaps that lie close
together are asked for as one span, since a request costs a round trip and may be lost itself.

Bytes are given out in order only. So the receiver has always stored the start of the log, and its
length is all that is needed to resume.
"""

from __future__ import annotations

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.logs.log_parts import LogDownloader
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.outbox import TimedOutbox

_DATA = mavlink.MAVLink_log_data_message
_PACKET_BYTES = 90
_SPAN_BYTES = 128 * _PACKET_BYTES
# Received bytes between two gaps that are rather sent again than asked around.
_MERGED_BYTES = 16 * _PACKET_BYTES
RATE_BYTES_S = 72_000.0
"""At most: 800 messages a second, below what a fleet takes from one vehicle (1000), so that
telemetry on the same link and the other vehicles on the same thread are not affected."""
_FIRST_QUIET_S, _SHORTEST_QUIET_S, _LONGEST_QUIET_S = 1.5, 0.2, 3.0
_ROUND_TRIPS = 3.0
_PAUSE_S = 0.3
_BACKED_OFF = 4.0
_ATTEMPTS = 20


class LogDownload(LogDownloader, TimedOutbox):
    """Downloads one log by LOG_REQUEST_DATA."""

    def __init__(self, address: Address, log: StoredLog, offset_bytes: int = 0) -> None:
        """Prepare for a log, in the conversation of an address; `start` asks."""
        super().__init__(log, offset_bytes)
        self._address = address
        self._missing = [(offset_bytes, log.size_bytes)] if offset_bytes < log.size_bytes else []
        self._held = bytearray(_SPAN_BYTES)
        self._asked = (offset_bytes, offset_bytes)
        self._asked_s = 0.0
        self._repeated = False
        self._came = 0
        self._over = False
        self._attempts = 0
        self._quiet_s, self._longest_s = _FIRST_QUIET_S, _LONGEST_QUIET_S

    def start(self, now: float) -> None:
        """Ask for the first span."""
        self._go_on(now)

    def receive(self, message: Message, now: float) -> None:
        """Take LOG_DATA of this log."""
        if message.__class__ is not _DATA or self.deadline_s is None:
            return
        if message.id != self._log.log_id or message.count > _PACKET_BYTES:
            return
        start, stop = message.ofs, message.ofs + message.count
        self._note_answer(start, now)
        self._came += self._keep(start, bytes(message.data[: message.count]))
        if not self._missing:
            self._go_on(now)
            return
        # A short packet ends an answer, too: the log's end, or a read error of the autopilot.
        last = stop >= self._asked[1] or message.count < _PACKET_BYTES
        if last and self._came and start >= self._asked[0]:
            self._over = True
            taken_s = (self._asked[1] - self._asked[0]) / RATE_BYTES_S
            self.deadline_s = max(now, self._asked_s + taken_s)
        elif not self._over:
            self.deadline_s = now + self._pause_s()

    def _on_deadline(self, now: float) -> None:
        """Ask for the next span, or again for what has not come; or give up."""
        if not self._came:
            self._attempts += 1
            self._quiet_s = min(2.0 * self._quiet_s, self._longest_s)
        if self._attempts >= _ATTEMPTS:
            self.deadline_s = None
            self.problem = self._stopped_sending(f"log {self._log.log_id}", _ATTEMPTS)
            self.end()
            return
        self._go_on(now)

    def end(self) -> None:
        """End the transfer on the autopilot's side; the rest of an answer is ignored."""
        self.deadline_s = None
        self.outbox = [self._to_autopilot("LOG_REQUEST_END")]

    def _go_on(self, now: float) -> None:
        """Give out what is complete, and ask for the first gap."""
        self._give_out_complete()
        if not self._missing:
            self.done = True
            self.end()
            return
        start, stop = self._missing[0]
        for gap_start, gap_stop in self._missing[1:]:
            if gap_start - stop > _MERGED_BYTES:
                break
            stop = gap_stop
        asked = (start, min(stop, start + _SPAN_BYTES))
        if self._came:
            self._attempts = 0
        self._repeated = asked == self._asked
        self._asked, self._asked_s = asked, now
        self._came, self._over = 0, False
        self.deadline_s = now + self._quiet_s
        self.outbox.append(
            self._to_autopilot(
                "LOG_REQUEST_DATA",
                id=self._log.log_id,
                ofs=asked[0],
                count=asked[1] - asked[0],
            )
        )

    def _give_out_complete(self) -> None:
        complete = self._missing[0][0] if self._missing else self._log.size_bytes
        size = complete - self._base
        if size > 0:
            self._give_out(bytes(self._held[:size]))
            self._held[:size] = b""
            self._held.extend(bytes(size))

    def _keep(self, start: int, data: bytes) -> int:
        """Keep what is missing of it; return how many bytes were."""
        end = min(self._base + _SPAN_BYTES, self._log.size_bytes)
        first, stop = max(start, self._base), min(start + len(data), end)
        if first >= stop:
            return 0
        before = sum(gap[1] - gap[0] for gap in self._missing)
        missing: list[tuple[int, int]] = []
        for gap_start, gap_stop in self._missing:
            if stop <= gap_start or first >= gap_stop:
                missing.append((gap_start, gap_stop))
                continue
            if gap_start < first:
                missing.append((gap_start, first))
            if stop < gap_stop:
                missing.append((stop, gap_stop))
        self._missing = missing
        self._held[first - self._base : stop - self._base] = data[first - start : stop - start]
        return before - sum(gap[1] - gap[0] for gap in missing)

    def _pause_s(self) -> float:
        """Return how long an answer that has begun may pause before it counts as over."""
        return min(self._quiet_s, max(_PAUSE_S, self._round_trip_s))

    def _note_answer(self, start: int, now: float) -> None:
        """Learn from the first answer to a request how long to wait for one."""
        if self._came or self._repeated or not self._asked[0] <= start < self._asked[1]:
            return
        self._note_round_trip(now - self._asked_s)
        wanted_s = _ROUND_TRIPS * self._round_trip_s
        self._quiet_s = min(max(wanted_s, _SHORTEST_QUIET_S), _LONGEST_QUIET_S)
        # On a lossy link repetitions are lost, too; they need not become ever slower.
        self._longest_s = min(_BACKED_OFF * self._quiet_s, _LONGEST_QUIET_S)

    def _to_autopilot(self, name: str, **fields: int) -> Message:
        return make(
            name,
            target_system=self._address.target_system,
            target_component=self._address.target_component,
            **fields,
        )
