"""Differences between the versions of rclpy, from Humble's 3.3 on.

Each is found by asking whether the thing is there, never by a version or by the name of a
distribution. What differs between the versions of nav2_msgs is in
`nav2/forms.py`.
"""

from __future__ import annotations

from rclpy.executors import Executor

__all__ = ["executes_tasks"]


def executes_tasks(executor: Executor) -> bool:
    """Whether an executor is executing tasks, such as an action's execute callbacks.

    rclpy's own count of callbacks leaves them out. Those that are not done are a list with their
    entities up to Kilted, and the keys of a table since ros2/rclpy pull request 1469 (Lyrical).
    """
    with executor._tasks_lock:
        if hasattr(executor, "_tasks"):
            return any(task.executing() for task, _, _ in executor._tasks)
        return any(task.executing() for task in executor._pending_tasks)
