"""Downloads one log by MAVFTP: ReadFile, a few requests at a time.

BurstReadFile is not used. An ArduPilot answers one with up to 2000 packets that nothing stops
(GCS_FTP.cpp), whatever becomes of the vehicle, and telemetry on the same link would starve. The
rate of single reads is ours, and what is lost is simply read again.

Bytes are given out in order only, as in :mod:`~mavlink_vehicle.protocols.logs.log_download`.
"""

from __future__ import annotations

from dataclasses import dataclass

from mavlink_vehicle.codec import Message
from mavlink_vehicle.events import StoredLog
from mavlink_vehicle.protocols.logs.ftp import (
    DATA_BYTES,
    FtpAnswer,
    FtpError,
    FtpLine,
    FtpOp,
    FtpQuestion,
)
from mavlink_vehicle.protocols.logs.log_download import RATE_BYTES_S
from mavlink_vehicle.protocols.logs.log_parts import LogDownloader

# An ArduPilot keeps 5 requests, and drops what comes while it has as many.
_WINDOW = 4
_SPACING_S = DATA_BYTES / RATE_BYTES_S
# Bytes that arrive early are kept, up to this many, until those before them have come.
_AHEAD_BYTES = 64 * DATA_BYTES
_QUIET_S, _QUIET_MAX_S = 0.15, 3.0
_ROUND_TRIPS = 3.0
# Both firmwares answer in order: a request that this many later ones have overtaken is lost.
_OVERTAKEN = 2
_FAILURES_MAX = 80
# A file that somebody else, or we before, left open. An ArduPilot closes it after 3 to 20 s; a PX4
# after 10 s without any request, so that asking more often would keep it open.
_BUSY_AGAIN_S, _BUSY_ATTEMPTS = 12.0, 3
_BUSY = (FtpError.NO_SESSIONS, FtpError.FAIL)
# The autopilot has closed the file as nothing was asked for: we hung, or the link was interrupted.
_CLOSED = (FtpError.INVALID_SESSION, FtpError.NOT_FOUND)
_OPENED_MAX = 5


@dataclass
class _Read:
    """A request that is not answered yet; `order` counts all of them."""

    number: int
    order: int
    sent_s: float
    deadline: float


class FtpLogDownload(LogDownloader):
    """Downloads one log by MAVFTP."""

    def __init__(self, line: FtpLine, log: StoredLog, offset_bytes: int = 0) -> None:
        """Prepare for a log that MAVFTP listed, by a line to the autopilot; `start` asks."""
        super().__init__(log, offset_bytes)
        self._line = line
        self._next = offset_bytes
        self._opening: FtpQuestion | None = None
        self._is_open = False
        self._busy = self._opened = 0
        self._again_s: float | None = None
        self._free_s = 0.0
        self._reads: dict[int, _Read] = {}
        self._gaps: list[int] = []
        self._came: dict[int, bytes] = {}
        self._sizes: dict[int, int] = {}
        self._failures = 0
        self._order = 0

    def start(self, now: float) -> None:
        """Open the file."""
        if self._base >= self._log.size_bytes:
            self.done = True
            return
        self._opening = FtpQuestion(self._line, FtpOp.OPEN_TO_READ, path=self._log.path)
        self.handle_timer(now)

    def receive(self, message: Message, now: float) -> None:
        """Take an answer."""
        answer = FtpAnswer.of(message, self._line.address)
        if answer is None or self.done or self.problem:
            return
        if self._opening is not None:
            self._opening.receive(answer)
            if self._opening.answer is not None:
                self._take_opened(self._opening.answer, now)
        elif self._is_open and answer.op is FtpOp.READ:
            self._take_read(answer, now)

    @property
    def deadline_s(self) -> float | None:
        """Return when to read on, or again."""
        if self.done or self.problem:
            return None
        if self._opening is not None:
            return self._opening.deadline_s
        if self._again_s is not None:
            return self._again_s
        deadlines = [read.deadline for read in self._reads.values()]
        if self._wants_more():
            deadlines.append(self._free_s)
        return min(deadlines, default=None)

    def handle_timer(self, now: float) -> None:
        """Read on, or again what has not come; or give up."""
        if self.done or self.problem:
            return
        if self._again_s is not None and now >= self._again_s:
            self._again_s = None
            self._opening = FtpQuestion(self._line, FtpOp.OPEN_TO_READ, path=self._log.path)
        if self._opening is not None:
            message = self._opening.handle_timer(now)
            if message is not None:
                self.outbox.append(message)
            if self._opening.gave_up:
                self._give_up(f"The autopilot did not open {self._log.path} over MAVFTP.")
            return
        if self._is_open:
            self._read_on(now)

    def end(self) -> None:
        """Close the file; the rest of the answers is ignored."""
        if self._is_open or self._opening is not None:
            # Twice, as a file that stays open is in the way of the next download.
            self.outbox = [self._line.request(FtpOp.TERMINATE)[1] for _ in range(2)]
        self._is_open, self._opening = False, None

    def _give_up(self, problem: str) -> None:
        self.end()
        self.problem = problem

    def _take_opened(self, answer: FtpAnswer, now: float) -> None:
        self._opening = None
        if answer.error in _BUSY and self._busy < _BUSY_ATTEMPTS:
            self._busy += 1
            self._again_s = now + _BUSY_AGAIN_S
        elif answer.error is not None:
            reason = answer.error.name.lower().replace("_", " ")
            self._give_up(f"The autopilot does not open {self._log.path} over MAVFTP: {reason}.")
        else:
            self._is_open = True
            self._opened += 1
            self._line.session = answer.session
            self._read_on(now)

    def _take_read(self, answer: FtpAnswer, now: float) -> None:
        number = answer.sequence
        offset = next((at for at, read in self._reads.items() if read.number == number), None)
        if offset is None:
            return  # an answer to what was asked for again meanwhile
        read = self._reads.pop(offset)
        if answer.error is not None or not answer.data or answer.offset != offset:
            self._fail(offset, answer.error, now)
        else:
            self._failures = 0
            took_s = now - read.sent_s
            for other in self._reads.values():
                if other.order <= read.order - _OVERTAKEN:
                    other.deadline = now
            self._note_round_trip(took_s)
            wanted = self._sizes.pop(offset)
            self._came[offset] = answer.data[:wanted]
            if len(answer.data) < wanted:
                self._gaps.append(offset + len(answer.data))
                self._sizes[offset + len(answer.data)] = wanted - len(answer.data)
            self._give_out_parts()
        if not self.done and not self.problem:
            self._read_on(now)

    def _fail(self, offset: int, error: FtpError | None, now: float) -> None:
        """Read a part again, unless the autopilot has nothing there."""
        self._failures += 1
        self._gaps.append(offset)
        if error in _CLOSED and self._opened < _OPENED_MAX:
            self._gaps += self._reads
            self._reads.clear()
            self._is_open, self._line.session = False, 0
            self._again_s = now
        elif error in (FtpError.END_OF_FILE, *_CLOSED):
            self._give_up(
                f"The autopilot ended the reading of {self._log.path} at byte {offset} of "
                f"{self._log.size_bytes}."
            )
        elif self._failures >= _FAILURES_MAX:
            self._give_up(self._stopped_sending(self._log.path, _FAILURES_MAX))

    def _wants_more(self) -> bool:
        if not self._is_open or len(self._reads) >= _WINDOW:
            return False
        limit = min(self._log.size_bytes, self._base + _AHEAD_BYTES)
        return bool(self._gaps) or self._next < limit

    def _read_on(self, now: float) -> None:
        for offset in [at for at, read in self._reads.items() if now >= read.deadline]:
            del self._reads[offset]
            self._fail(offset, None, now)
        while not self.problem and self._wants_more() and now >= self._free_s:
            self._gaps.sort()
            if self._gaps:
                offset = self._gaps.pop(0)
            else:
                offset = self._next
                self._sizes[offset] = min(DATA_BYTES, self._log.size_bytes - offset)
                self._next += self._sizes[offset]
            number, message = self._line.request(FtpOp.READ, offset, self._sizes[offset])
            quiet_s = min(max(_ROUND_TRIPS * self._round_trip_s, _QUIET_S), _QUIET_MAX_S)
            self._reads[offset] = _Read(number, self._order, now, now + quiet_s)
            self._order += 1
            self.outbox.append(message)
            self._free_s = max(self._free_s, now) + _SPACING_S

    def _give_out_parts(self) -> None:
        parts = b""
        while (data := self._came.pop(self._base + len(parts), None)) is not None:
            parts += data
        self._give_out(parts)
        if self._base >= self._log.size_bytes:
            self.end()
            self.done = True
