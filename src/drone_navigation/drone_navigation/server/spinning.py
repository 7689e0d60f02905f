"""Executor threads for ROS callbacks."""

from __future__ import annotations

import threading

from rclpy.executors import Executor, ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node

from drone_navigation.process_control.ros_differences import executes_tasks

# One thread for each goal that is parked on its event, and some for goal, cancel and
# result requests. A replaced goal leaves its thread within milliseconds. They are only
# made when they are needed.
_EXECUTOR_THREADS = 8


class Spinner:
    """Spins an executor for one node in a thread of its own."""

    def __init__(self, node: Node, executor: Executor | None = None) -> None:
        """Put together; :meth:`start` begins.

        Args:
            node: whose callbacks are executed.
            executor: by default one with a thread for each goal.
        """
        if executor is None:
            executor = MultiThreadedExecutor(num_threads=_EXECUTOR_THREADS)
        self._node = node
        self._executor = executor
        executor.add_node(node)
        self._stopping = False
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)

    def start(self) -> None:
        """Start the executor."""
        self._thread.start()

    @property
    def is_busy(self) -> bool:
        """Whether callbacks are being executed, those of parked goals included."""
        return executes_tasks(self._executor)

    def stop(self, timeout_s: float) -> None:
        """Stop the executor and its thread.

        An executor's shutdown destroys what callbacks that have been begun still use. So it is left
        to them, unless one of them never ends.
        """
        self._executor.create_task(self._end)
        self._thread.join(0.5 * timeout_s)
        if self._thread.is_alive():
            self._stopping = True
            self._executor.shutdown(timeout_sec=0.0)
            # A daemon thread that the interpreter ends inside rclpy's C++ ends the process with it.
            self._thread.join(0.5 * timeout_s)

    def _end(self) -> None:
        self._stopping = True
        self._executor.create_task(int)  # ends the wait for work that may have begun

    def _spin(self) -> None:
        """Spin until stopped, surviving what rclpy itself lets escape.

        A KeyError can escape from an expiring goal (ros2/rclpy issues 1236, 1667); a server
        that flies a vehicle must not end because of it.
        """
        while not self._stopping and self._executor.context.ok():
            try:
                self._executor.spin_once()
            except ExternalShutdownException:
                return
            except Exception as error:
                self._node.get_logger().error(f"A ROS callback failed and was skipped: {error!r}")
