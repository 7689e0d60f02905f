"""The autopilot's own logs for clients: listed, downloaded, and when neither is done. No ROS.

Nothing is transferred while the vehicle is armed or a goal is active, and both end a transfer: an
ArduPilot gives no logs while it is armed, and does not log a flight while it gives one
(AP_Logger::should_log). The end goes out before what a goal sends.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import (
    LogChunkReceived,
    LogsListed,
    LogTransferEnded,
    OperationResult,
    StoredLog,
    VehicleEvent,
)
from navigation_bridge.requests.feature import Feature, FeatureParts
from navigation_core.outcomes import OutcomeCode, Rejection


@dataclass(frozen=True)
class LogsFound:
    """The list that a request asked for; `LogRequestDone` follows.

    Attributes:
        logs: by their numbers.
        newest: the log of the last flight; None without a log.
        system_id: MAVLink system of the vehicle.
        suffix: of files of this firmware's format.
    """

    logs: tuple[StoredLog, ...]
    newest: StoredLog | None
    system_id: int
    suffix: str


@dataclass(frozen=True)
class LogBytes:
    """The next bytes of the log that a request downloads."""

    offset_bytes: int
    data: bytes


@dataclass(frozen=True)
class LogRequestDone:
    """The end of a request; each has one."""

    code: OutcomeCode
    message: str


LogOutput: TypeAlias = LogsFound | LogBytes | LogRequestDone
TakeLog: TypeAlias = Callable[[LogOutput], object]

_CODES = {
    OperationResult.ACHIEVED: OutcomeCode.SUCCESS,
    OperationResult.REFUSED: OutcomeCode.BUSY,
    OperationResult.TIMED_OUT: OutcomeCode.TIMEOUT,
    OperationResult.CANCELLED: OutcomeCode.PREEMPTED,
    OperationResult.LINK_LOST: OutcomeCode.LINK_LOST,
}


class LogRequests(Feature):
    """Serves one request about logs at a time; its taker gets what comes of it."""

    def __init__(self, parts: FeatureParts) -> None:
        """Prepare."""
        super().__init__(parts)
        self._vehicle = parts.vehicle
        self._taker: TakeLog | None = None
        self._stopped: OutcomeCode | None = None

    def list_logs(self, take: TakeLog, now: float) -> None:
        """List the logs; `LogsFound` and `LogRequestDone` answer.

        Args:
            take: takes the answers.
            now: time in seconds.
        """
        if self._may_begin(take):
            self._vehicle.logs.list_logs(now)

    def download(self, log: StoredLog, offset_bytes: int, take: TakeLog, now: float) -> None:
        """Download a log; `LogBytes` and `LogRequestDone` answer.

        Args:
            log: as it was listed.
            offset_bytes: where to begin, 0 to the log's size.
            take: takes the answers.
            now: time in seconds.
        """
        if self._may_begin(take):
            self._vehicle.logs.download(log, offset_bytes, now)

    def stop(self, take: TakeLog) -> None:
        """End the request of a taker as CANCELED, if it is the one under way."""
        if self._taker == take:
            self._stopped = OutcomeCode.CANCELED
            self._end("The download was canceled.")

    def give_way(self, reason: str) -> None:
        """End the request in progress as PREEMPTED: the vehicle is about to be flown."""
        self._end(reason)

    def take(self, event: VehicleEvent) -> bool:
        """Process an event of the vehicle; return whether it is about a transfer of logs."""
        if not isinstance(event, (LogsListed, LogChunkReceived, LogTransferEnded)):
            return False
        take = self._taker
        if take is None:
            return True
        if isinstance(event, LogsListed):
            take(self._found(event.logs))
        elif isinstance(event, LogChunkReceived):
            take(LogBytes(event.offset_bytes, event.data))
        else:
            code = self._stopped or _CODES[event.result]
            self._taker = self._stopped = None
            take(LogRequestDone(code, event.reason))
        return True

    def _end(self, reason: str) -> None:
        """End the transfer in progress, and answer it before another request can begin."""
        logs = self._vehicle.logs
        logs.stop(reason)
        while (event := logs.next_event()) is not None:
            self.take(event)

    def _may_begin(self, take: TakeLog) -> bool:
        rejection = self._rejection()
        if rejection is None:
            self._taker, self._stopped = take, None
            return True
        take(LogRequestDone(rejection.code, rejection.message))
        return False

    def _rejection(self) -> Rejection | None:
        vehicle, occupied = self._vehicle, self.parts.occupied()
        if occupied is not None:
            return occupied
        if not vehicle.heartbeats.alive:
            return Rejection(OutcomeCode.NO_VEHICLE, "There is no connection to a vehicle.")
        if vehicle.state.armed:
            text = "The vehicle is armed; disarm it to list or download logs."
            return Rejection(OutcomeCode.BUSY, text)
        if vehicle.logs.busy or vehicle.operations.operation_id is not None:
            return Rejection(OutcomeCode.BUSY, "Another request is being processed; try again.")
        return None

    def _found(self, logs: tuple[StoredLog, ...]) -> LogsFound:
        state = self._vehicle.state
        is_px4 = state.autopilot == mavlink.MAV_AUTOPILOT_PX4

        def age(log: StoredLog) -> tuple[int, int]:
            # A PX4 numbers them as its file system lists them; an ArduPilot by age, and without
            # a GPS it does not know the time.
            return (log.time_utc_s if is_px4 else 0, log.log_id)

        newest = max(logs, key=age, default=None)
        return LogsFound(logs, newest, state.system_id, ".ulg" if is_px4 else ".bin")
