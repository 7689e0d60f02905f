"""Commands of ``navigation_client`` about the autopilot's own logs: ``logs``, ``download``."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

from rclpy.action import ActionClient
from rclpy.action.client import ClientGoalHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from custom_interfaces.action import DownloadLog
from custom_interfaces.msg import GoalCode
from custom_interfaces.srv import ListLogs
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_CANCELED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
)
from drone_navigation.client.process import (
    SPIN_S,
    ServerSigns,
    client_node,
    on_interrupt,
    wait_for,
)
from drone_navigation.client.servers import no_server
from navigation_bridge.names import DOWNLOAD_LOG_ACTION_NAME, SERVER_NODE_NAME

__all__ = ["run_log_command"]

# The server gives up a list after eight requests of 1.5 s, and may then list by MAVFTP.
_LIST_TIMEOUT_S = 60.0
_ANSWER_TIMEOUT_S = 10.0
# The server ends a download without progress after a minute.
_SILENCE_S = 100.0
_UNITS = ("B", "kB", "MB", "GB")


def run_log_command(options: argparse.Namespace, argv: list[str]) -> int:
    """Run the command and return the exit code."""
    with ExitStack() as on_exit:
        node = on_exit.enter_context(client_node(argv, options.vehicle))
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        on_exit.callback(lambda: executor.shutdown(timeout_sec=1.0))
        command = _LogCommand(node, executor, options)
        on_interrupt(command.interrupt)
        return command.list_logs() if options.command == "logs" else command.download()


class _LogCommand:
    """One command, from finding the server to the answer."""

    def __init__(
        self, node: Node, executor: SingleThreadedExecutor, options: argparse.Namespace
    ) -> None:
        self._node = node
        self._executor = executor
        self._options = options
        self._interrupted = 0
        self._signs = ServerSigns(node)
        self._heard_s = time.monotonic()
        self._drawn = False
        self._shown_percent = -1

    def interrupt(self) -> None:
        """Cancel the download; a second time, stop waiting."""
        self._interrupted += 1

    def list_logs(self) -> int:
        """Show the list."""
        client = self._node.create_client(ListLogs, f"{SERVER_NODE_NAME}/list_logs")
        if not self._wait(client.service_is_ready, self._options.server_timeout):
            return self._without_server(f"{SERVER_NODE_NAME}/list_logs")
        answer = client.call_async(ListLogs.Request())
        if code := self._unanswered(answer.done, _LIST_TIMEOUT_S, client.service_is_ready):
            return code
        result = answer.result()
        facts = [
            {"log_id": log.log_id, "bytes": log.size, "time_utc": _time(log.stamp.sec)}
            for log in result.logs
        ]
        if not self._options.json:
            for log in facts:
                print(f"{log['log_id']:>5}  {size_text(log['bytes']):>9}  {log['time_utc'] or '-'}")
        code = EXIT_SUCCESS if result.success else EXIT_REJECTED
        return self._tell_end(code, result.message, logs=facts)

    def download(self) -> int:
        """Download a log, with progress, until the result."""
        client = ActionClient(self._node, DownloadLog, DOWNLOAD_LOG_ACTION_NAME)
        try:
            if not self._wait(client.server_is_ready, self._options.server_timeout):
                return self._without_server(DOWNLOAD_LOG_ACTION_NAME)
            goal = DownloadLog.Goal(log_id=self._options.log_id)
            sent = client.send_goal_async(goal, self._show_progress)
            if code := self._unanswered(sent.done, _ANSWER_TIMEOUT_S, client.server_is_ready):
                return code
            handle = sent.result()
            if not handle.accepted:
                return self._tell_end(EXIT_REJECTED, "The server rejected the download.")
            return self._follow(handle, client.server_is_ready)
        finally:
            client.destroy()

    def _follow(self, handle: ClientGoalHandle, is_ready: Callable[[], bool]) -> int:
        answer, canceled = handle.get_result_async(), False
        self._heard_s = time.monotonic()
        self._signs.begin()
        while not answer.done():
            if self._interrupted and not canceled:
                canceled = True
                handle.cancel_goal_async()
            if self._interrupted > 1:
                return self._tell_end(EXIT_ABORTED, "Stopped waiting for the end.")
            if time.monotonic() - self._heard_s > _SILENCE_S:
                return self._tell_end(EXIT_NO_SERVER, "The server no longer responds.")
            if why := self._signs.why_gone(is_ready()):
                return self._tell_end(EXIT_NO_SERVER, why)
            self._spin_once()
        result = answer.result().result
        code = EXIT_ABORTED
        if result.success:
            code = EXIT_SUCCESS
        elif result.error_code == GoalCode.CANCELED:
            code = EXIT_CANCELED
        elif result.error_code in (
            GoalCode.BUSY,
            GoalCode.NO_VEHICLE,
            GoalCode.INVALID_NUMBER,
        ):
            code = EXIT_REJECTED
        facts = {"path": result.path or None, "bytes": result.bytes_stored, "size": result.size}
        return self._tell_end(code, result.message, **facts)

    def _show_progress(self, message: DownloadLog.Impl.FeedbackMessage) -> None:
        feedback = message.feedback
        self._heard_s = time.monotonic()
        percent = 100.0 * feedback.bytes_stored / max(feedback.size, 1)
        if self._options.json:
            facts = {"log_id": feedback.log_id, "bytes": feedback.bytes_stored}
            facts |= {"size": feedback.size, "bytes_per_s": round(feedback.rate)}
            print(json.dumps({"event": "progress", **facts}), flush=True)
            return
        text = (
            f"log {feedback.log_id}: {size_text(feedback.bytes_stored)} of "
            f"{size_text(feedback.size)} ({percent:.0f} %), {size_text(feedback.rate)}/s"
        )
        if sys.stdout.isatty() and not self._options.plain:
            self._drawn = True
            print(f"\r\x1b[K{text}", end="", flush=True)
        elif int(percent) // 10 != self._shown_percent // 10:
            self._shown_percent = int(percent)
            print(text, flush=True)

    def _without_server(self, name: str) -> int:
        return self._tell_end(EXIT_NO_SERVER, no_server(self._node, name))

    def _tell_end(self, code: int, text: str, **facts: object) -> int:
        if self._options.json:
            outcome = {"success": code == EXIT_SUCCESS, "message": text, **facts}
            print(json.dumps({"event": self._options.command, **outcome}))
        else:
            print(f"\n{text}" if self._drawn else text)
        return code

    def _unanswered(
        self, is_done: Callable[[], bool], timeout_s: float, is_ready: Callable[[], bool]
    ) -> int:
        """Wait for an answer as long as there is a server; return 0, or the exit code."""
        why = self._signs.wait_for_answer(
            is_done, is_ready, timeout_s, self._spin_once, lambda: self._interrupted > 0
        )
        if not why:
            return EXIT_SUCCESS
        if self._interrupted:
            return self._tell_end(EXIT_CANCELED, "Interrupted; the server may still work on it.")
        return self._tell_end(EXIT_NO_SERVER, why)

    def _wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        return wait_for(condition, timeout_s, self._spin_once, lambda: self._interrupted > 0)

    def _spin_once(self) -> None:
        self._executor.spin_once(timeout_sec=SPIN_S)


def _time(unix_s: int) -> str | None:
    return time.strftime("%Y-%m-%d %H:%M:%SZ", time.gmtime(unix_s)) if unix_s else None


def size_text(size_bytes: float) -> str:
    """Return a number of bytes for people: three digits and a decimal unit."""
    for unit in _UNITS[:-1]:
        if size_bytes < 999.5:
            return f"{size_bytes:.3g} {unit}"
        size_bytes /= 1000.0
    return f"{size_bytes:.3g} {_UNITS[-1]}"
