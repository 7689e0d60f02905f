"""The autopilot's own logs for clients: listed, downloaded, and when neither is done. No ROS.

Nothing is transferred while the vehicle is armed or a goal is active, and both end a transfer: an
ArduPilot gives no logs while it is armed, and does not log a flight while it gives one
(AP_Logger::should_log). The end goes out before what a goal sends.
"""

from __future__ import annotations

from collections.abc import Callable

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import (
    LogChunkReceived,
    LogsListed,
    LogTransferEnded,
    OperationResult,
    StoredLog,
    VehicleEvent,
)
from mavlink_vehicle.vehicle import Vehicle
from navigation_bridge.goals.log_outputs import LogBytes, LogOutput, LogRequestDone, LogsFound
from navigation_core.outcomes import OutcomeCode, Rejection

_CODES = {
    OperationResult.ACHIEVED: OutcomeCode.SUCCESS,
    OperationResult.REFUSED: OutcomeCode.BUSY,
    OperationResult.TIMED_OUT: OutcomeCode.TIMEOUT,
    OperationResult.CANCELLED: OutcomeCode.PREEMPTED,
    OperationResult.LINK_LOST: OutcomeCode.LINK_LOST,
}


class LogRequests:
    """Serves one request about logs at a time."""

    def __init__(
        self,
        vehicle: Vehicle,
        put_out: Callable[[LogOutput], object],
        refusal: Callable[[], Rejection | None],
    ) -> None:
        """Prepare.

        Args:
            vehicle: whose logs.
            put_out: takes the outputs.
            refusal: returns why the bridge does not serve such a request now, or None.
        """
        self._vehicle = vehicle
        self._put_out = put_out
        self._refusal = refusal
        self._number: int | None = None
        self._stopped: OutcomeCode | None = None

    def list_logs(self, number: int, now: float) -> None:
        """List the logs; `LogsFound` and `LogRequestDone` answer.

        Args:
            number: of the request.
            now: time in seconds.
        """
        if self._may_begin(number):
            self._vehicle.logs.list_logs(now)

    def download(self, number: int, log: StoredLog, offset_bytes: int, now: float) -> None:
        """Download a log; `LogBytes` and `LogRequestDone` answer.

        Args:
            number: of the request.
            log: as it was listed.
            offset_bytes: where to begin, 0 to the log's size.
            now: time in seconds.
        """
        if self._may_begin(number):
            self._vehicle.logs.download(log, offset_bytes, now)

    def stop(self, number: int) -> None:
        """End a request as CANCELED, if it is the one under way."""
        if self._number == number:
            self._stopped = OutcomeCode.CANCELED
            self._end("The download was canceled.")

    def give_way(self, reason: str) -> None:
        """End the request in progress as PREEMPTED: the vehicle is about to be flown."""
        self._end(reason)

    def take(self, event: VehicleEvent) -> bool:
        """Process an event of the vehicle; return whether it is about a transfer of logs."""
        if not isinstance(event, (LogsListed, LogChunkReceived, LogTransferEnded)):
            return False
        number = self._number
        if number is None:
            return True
        if isinstance(event, LogsListed):
            self._put_out(self._found(number, event.logs))
        elif isinstance(event, LogChunkReceived):
            self._put_out(LogBytes(number, event.offset_bytes, event.data))
        else:
            code = self._stopped or _CODES[event.result]
            self._number = self._stopped = None
            self._put_out(LogRequestDone(number, code, event.reason))
        return True

    def _end(self, reason: str) -> None:
        """End the transfer in progress, and answer it before another request can begin."""
        logs = self._vehicle.logs
        logs.stop(reason)
        while (event := logs.next_event()) is not None:
            self.take(event)

    def _may_begin(self, number: int) -> bool:
        rejection = self._rejection()
        if rejection is None:
            self._number, self._stopped = number, None
            return True
        self._put_out(LogRequestDone(number, rejection.code, rejection.message))
        return False

    def _rejection(self) -> Rejection | None:
        vehicle = self._vehicle
        refusal = self._refusal()
        if refusal is not None:
            return refusal
        if not vehicle.heartbeats.alive:
            return Rejection(OutcomeCode.NO_VEHICLE, "There is no connection to a vehicle.")
        if vehicle.state.armed:
            text = "The vehicle is armed; disarm it to list or download logs."
            return Rejection(OutcomeCode.BUSY, text)
        if vehicle.logs.busy or vehicle.operations.operation_id is not None:
            return Rejection(OutcomeCode.BUSY, "Another request is being processed; try again.")
        return None

    def _found(self, number: int, logs: tuple[StoredLog, ...]) -> LogsFound:
        state = self._vehicle.state
        is_px4 = state.autopilot == mavlink.MAV_AUTOPILOT_PX4

        def age(log: StoredLog) -> tuple[int, int]:
            # A PX4 numbers them as its file system lists them; an ArduPilot by age, and without
            # a GPS it does not know the time.
            return (log.time_utc_s if is_px4 else 0, log.log_id)

        newest = max(logs, key=age, default=None)
        return LogsFound(number, logs, newest, state.system_id, ".ulg" if is_px4 else ".bin")
