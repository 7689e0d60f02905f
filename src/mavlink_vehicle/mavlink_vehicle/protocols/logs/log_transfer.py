"""One transfer of the autopilot's own logs at a time: a list, or a download."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import (
    LogChunkReceived,
    LogMeans,
    LogsListed,
    LogTransferEnded,
    OperationResult,
    StoredLog,
)
from mavlink_vehicle.protocols.logs.ftp import FTP_MESSAGE, FtpLine
from mavlink_vehicle.protocols.logs.ftp_download import FtpLogDownload
from mavlink_vehicle.protocols.logs.ftp_list import FtpLogList
from mavlink_vehicle.protocols.logs.log_download import LogDownload
from mavlink_vehicle.protocols.logs.log_list import LogList
from mavlink_vehicle.protocols.logs.log_parts import LogDownloader, LogLister
from mavlink_vehicle.protocols.operations.command import Address
from mavlink_vehicle.protocols.service import SendingRank
from mavlink_vehicle.protocols.slot import Slot
from mavlink_vehicle.state.vehicle_state import VehicleState

_Part: TypeAlias = LogList | FtpLogList | LogDownload | FtpLogDownload


class LogTransfer(Slot[_Part]):
    """Lists and downloads logs; each transfer ends in one `LogTransferEnded`."""

    rank = SendingRank.LOGS
    asked_directly = True
    handles = (
        mavlink.MAVLink_log_entry_message, mavlink.MAVLink_log_data_message, FTP_MESSAGE
    )  # fmt: skip

    def __init__(self, address: Callable[[], Address], means: LogMeans = LogMeans.AUTO) -> None:
        """Prepare; `address` returns the addresses of the conversation."""
        super().__init__()
        self._address = address
        self._means = means

    @property
    def busy(self) -> bool:
        """Whether a transfer is in progress."""
        return self.pending is not None

    def list_logs(self, now: float) -> None:
        """Begin to list; a transfer in progress ends as CANCELLED."""
        is_ftp = self._means is LogMeans.FTP
        self._begin(self._ftp_list(now) if is_ftp else LogList(self._address()), now)

    def download(self, log: StoredLog, offset_bytes: int, now: float) -> None:
        """Begin to download a log; a transfer in progress ends as CANCELLED.

        Args:
            log: as it was listed since the autopilot started; without a list a PX4 gives no data.
            offset_bytes: where to begin, 0 to the log's size.
            now: time in seconds.
        """
        address = self._address()
        if log.path:
            self._begin(FtpLogDownload(FtpLine(address, now), log, offset_bytes), now)
        else:
            self._begin(LogDownload(address, log, offset_bytes), now)

    def link_lost(self, state: VehicleState, now: float) -> None:
        """End the transfer in progress, if any."""
        self.stop("The link to the autopilot was lost.", OperationResult.LINK_LOST)

    def vehicle_gone(self, reason: str, now: float) -> None:
        """End the transfer in progress, if any."""
        self.stop(f"{reason[0].upper()}{reason[1:]}.", OperationResult.LINK_LOST)

    def vehicle_armed(self) -> None:
        """End the transfer in progress, if any: it takes much of the link."""
        self.stop("The vehicle was armed.")

    def stop(self, reason: str, result: OperationResult = OperationResult.CANCELLED) -> None:
        """End the transfer in progress, if any."""
        if isinstance(self.pending, LogDownloader):
            self.pending.end()
        if self.pending is not None:
            self._end(result, reason)

    def _ftp_list(self, now: float) -> FtpLogList:
        return FtpLogList(FtpLine(self._address(), now))

    def _begin(self, part: _Part, now: float) -> None:
        self.stop("Replaced by another transfer.")
        self.pending = part
        part.start(now)
        self._collect(now)

    def _take_done(self, now: float) -> None:
        """Hand out what has come, and end what is complete or was given up."""
        part = self.pending
        if isinstance(part, LogList) and part.problem and self._means is LogMeans.AUTO:
            self.pending = part = self._ftp_list(now)
            part.start(now)
        if isinstance(part, LogLister) and part.logs is not None:
            self.events.append(LogsListed(tuple(part.logs.values())))
            self._end(OperationResult.ACHIEVED, f"The autopilot has {len(part.logs)} logs.")
        elif isinstance(part, LogDownloader):
            while (chunk := part.next_chunk()) is not None:
                self.events.append(LogChunkReceived(*chunk))
            if part.done:
                self._end(OperationResult.ACHIEVED, "The log was downloaded completely.")
        if self.pending is not None and self.pending.problem:
            self._end(OperationResult.TIMED_OUT, self.pending.problem)

    def _end(self, result: OperationResult, reason: str) -> None:
        self._vacate()
        self._set_deadline()
        self.events.append(LogTransferEnded(result, reason))
