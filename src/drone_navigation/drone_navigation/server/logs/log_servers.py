"""Service `~/list_logs` and action `download_log`: the autopilot's own logs.

The bridge hands out bytes on the driver's thread; the thread of the service or of the action takes
them from a queue and writes them, so that no disk delays the driver.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

from builtin_interfaces.msg import Time
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup

from custom_interfaces.action import DownloadLog
from custom_interfaces.msg import AutopilotLog, GoalCode
from custom_interfaces.srv import ListLogs
from drone_navigation.qos import RESULT_TIMEOUT_S
from drone_navigation.server.bridge_access import BridgeAccess
from drone_navigation.server.logs.log_file import LogFile, log_path
from mavlink_vehicle.events import StoredLog
from navigation_bridge.names import DOWNLOAD_LOG_ACTION_NAME
from navigation_bridge.requests.log_requests import (
    LogBytes,
    LogOutput,
    LogRequestDone,
    LogRequests,
    LogsFound,
    TakeLog,
)
from navigation_core.outcomes import OutcomeCode

_LOOK_S = 0.2
_FEEDBACK_S = 0.5
# The protocols give up sooner; this is for a driver thread that has ended.
_SILENCE_S = 90.0


class _EndedError(Exception):
    """A request has ended without success."""

    def __init__(self, code: OutcomeCode, text: str) -> None:
        super().__init__(text)
        self.code = code


class LogServers:
    """Serves one request at a time; others are rejected meanwhile."""

    def __init__(self, access: BridgeAccess) -> None:
        """Offer service and action; the folder of logs is made with the first one."""
        node = self._node = access.node
        self._bridge, self._driver, self._clock = access.bridge, access.driver, access.clock
        self._closed = access.is_closed
        self._folder = Path(access.config.log_directory).expanduser()
        self._take: TakeLog | None = None
        self._one = threading.Lock()
        group = ReentrantCallbackGroup()
        node.create_service(ListLogs, "~/list_logs", self._list, callback_group=group)
        self._action = ActionServer(
            node,
            DownloadLog,
            DOWNLOAD_LOG_ACTION_NAME,
            execute_callback=self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=group,
            result_timeout=RESULT_TIMEOUT_S,
        )

    # --- executor threads ----------------------------------------------------------------

    def _list(self, _request: ListLogs.Request, response: ListLogs.Response) -> ListLogs.Response:
        if not self._one.acquire(blocking=False):
            response.message = "Another log list or download is in progress; try again later."
            return response
        try:
            found = self._find(lambda: False)
        except _EndedError as end:
            response.message = str(end)
            return response
        finally:
            self._one.release()
        response.success = True
        response.message = f"The autopilot has {len(found.logs)} logs."
        response.logs = [_message(log) for log in found.logs]
        return response

    def _execute(self, handle: ServerGoalHandle) -> DownloadLog.Result:
        result = DownloadLog.Result()
        if not self._one.acquire(blocking=False):
            text = "Another log list or download is in progress; try again later."
            return self._end(handle, result, OutcomeCode.BUSY, text)
        try:
            self._download(handle, result)
        except _EndedError as end:
            return self._end(handle, result, end.code, str(end))
        except OSError as error:
            self._stop()
            text = f"The log cannot be stored: {error}."
            return self._end(handle, result, OutcomeCode.INTERNAL_ERROR, text)
        finally:
            self._one.release()
        text = f"Stored {result.size} bytes as {result.path}."
        return self._end(handle, result, OutcomeCode.SUCCESS, text)

    def _end(
        self, handle: ServerGoalHandle, result: DownloadLog.Result, code: OutcomeCode, text: str
    ) -> DownloadLog.Result:
        result.error_code = getattr(GoalCode, code.value)
        result.message = f"{code.value}: {text}"
        result.success = code is OutcomeCode.SUCCESS
        if result.success:
            handle.succeed()
        elif handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        self._node.get_logger().info(f"Log download ended: {result.message}")
        return result

    def _download(self, handle: ServerGoalHandle, result: DownloadLog.Result) -> None:
        found = self._find(lambda: handle.is_cancel_requested)
        log = _chosen(found, handle.request.log_id)
        path = log_path(self._folder, log, found.system_id, found.suffix)
        result.size = log.size_bytes
        if path.exists() and path.stat().st_size == log.size_bytes:
            result.path, result.bytes_stored = str(path.resolve()), log.size_bytes
            return
        with closing(LogFile(path, log.size_bytes)) as file:
            self._receive(handle, log, file, result)
            other = file.is_other_log
        if other:
            self._node.get_logger().warning(
                f"{path}.part belongs to another log; restarting the download"
            )
            with closing(LogFile(path, log.size_bytes, afresh=True)) as file:
                self._receive(handle, log, file, result)
        file.finish()
        result.path = str(path.resolve())

    def _receive(
        self, handle: ServerGoalHandle, log: StoredLog, file: LogFile, result: DownloadLog.Result
    ) -> None:
        """Store what comes until the log is complete, or turns out to be another one.

        Raises:
            _EndedError: it will not become complete now.
            OSError: the file cannot be written.
        """
        offset = file.resume_bytes
        feedback = DownloadLog.Feedback(log_id=log.log_id, size=log.size_bytes)
        began_s, reported_s = time.monotonic(), 0.0
        outputs = self._ask(
            lambda logs, take: logs.download(log, offset, take, self._clock.now()),
            lambda: handle.is_cancel_requested,
        )
        for output in outputs:
            if not isinstance(output, LogBytes):
                continue
            file.write(output.offset_bytes, output.data)
            if file.is_other_log:
                self._stop()
                return
            result.bytes_stored = feedback.bytes_stored = file.stored_bytes
            now_s = time.monotonic()
            if now_s - reported_s >= _FEEDBACK_S:
                reported_s = now_s
                came = output.offset_bytes + len(output.data) - offset
                feedback.rate = came / max(now_s - began_s, 1e-3)
                handle.publish_feedback(feedback)
        result.bytes_stored = file.stored_bytes
        if file.stored_bytes != log.size_bytes:
            raise _EndedError(
                OutcomeCode.INTERNAL_ERROR, "The download ended before the end of the log."
            )

    def _find(self, is_canceled: Callable[[], bool]) -> LogsFound:
        """Return the list.

        Raises:
            _EndedError: there is none.
        """
        found = None
        outputs = self._ask(lambda logs, take: logs.list_logs(take, self._clock.now()), is_canceled)
        for output in outputs:
            if isinstance(output, LogsFound):
                found = output
        if found is None:
            raise _EndedError(OutcomeCode.INTERNAL_ERROR, "The list ended without a result.")
        return found

    def _ask(
        self, request: Callable[[LogRequests, TakeLog], None], is_canceled: Callable[[], bool]
    ) -> Iterator[LogOutput]:
        """Request something of the bridge and yield what comes, until it is complete.

        Raises:
            _EndedError: the bridge ended it otherwise, or does not respond.
        """
        outputs: queue.SimpleQueue[LogOutput] = queue.SimpleQueue()
        take = self._take = outputs.put
        self._driver.post(lambda: request(self._bridge.feature(LogRequests), take))
        heard_s, stopping = time.monotonic(), False
        while time.monotonic() - heard_s < _SILENCE_S:
            if self._closed():
                self._stop()
                raise _EndedError(OutcomeCode.SHUTTING_DOWN, "The navigation server was stopped.")
            if is_canceled() and not stopping:
                stopping = True
                self._stop()
            try:
                output = outputs.get(timeout=_LOOK_S)
            except queue.Empty:
                continue
            heard_s = time.monotonic()
            if not isinstance(output, LogRequestDone):
                yield output
            elif output.code is OutcomeCode.SUCCESS:
                return
            else:
                raise _EndedError(output.code, output.message)
        raise _EndedError(OutcomeCode.INTERNAL_ERROR, "The driver thread does not respond.")

    def _stop(self) -> None:
        take = self._take
        if take is not None:
            self._driver.post(lambda: self._bridge.feature(LogRequests).stop(take))


def _chosen(found: LogsFound, log_id: int) -> StoredLog:
    """Return the log that a goal means.

    Raises:
        _EndedError: there is no such log.
    """
    if not found.logs:
        raise _EndedError(OutcomeCode.INVALID_NUMBER, "The autopilot has no logs.")
    if log_id == DownloadLog.Goal.LATEST and found.newest is not None:
        return found.newest
    for log in found.logs:
        if log.log_id == log_id:
            return log
    known = ", ".join(str(log.log_id) for log in found.logs)
    text = f"The autopilot has no log {log_id}; it has {known}."
    raise _EndedError(OutcomeCode.INVALID_NUMBER, text)


def _message(log: StoredLog) -> AutopilotLog:
    stamp = Time(sec=min(log.time_utc_s, 2**31 - 1))
    return AutopilotLog(log_id=log.log_id, size=log.size_bytes, stamp=stamp)
