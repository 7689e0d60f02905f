"""Differences between the versions of rclpy, from Humble's 3.3 on.

Each is found by asking whether the thing is there, never by a version or by the name of a
distribution. What differs between the versions of nav2_msgs is in
`nav2/forms.py`.
"""

from __future__ import annotations

from rclpy.executors import Executor
from rclpy.node import Node
from rclpy.subscription import Subscription

__all__ = ["executes_tasks", "publisher_count"]


def executes_tasks(executor: Executor) -> bool:
    """Whether an executor is executing tasks, such as an action's execute callbacks.

    rclpy's own count of callbacks leaves them out. Those that are not done are a list with their
    entities up to Kilted, and the keys of a table since ros2/rclpy pull request 1469 (Lyrical).
    """
    with executor._tasks_lock:
        if hasattr(executor, "_tasks"):
            return any(task.executing() for task, _, _ in executor._tasks)
        return any(task.executing() for task in executor._pending_tasks)


def publisher_count(node: Node, subscription: Subscription) -> int:
    """Return how many publishers a subscription is matched with, this process's included.

    Humble's subscriptions do not know. There the node is asked, which looks at all writers of the
    network: with 20 vehicles that took a twentieth of the server's time.
    """
    if hasattr(subscription, "get_publisher_count"):
        return int(subscription.get_publisher_count())
    return int(node.count_publishers(subscription.topic_name))
