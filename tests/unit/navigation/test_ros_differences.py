"""Both forms in which versions of rclpy keep their tasks are read; one is that of this rclpy."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.task import Task
from std_msgs.msg import String

from drone_navigation.process_control.ros_differences import executes_tasks, publisher_count
from tests.support.processes import patient_s


class LaterExecutor(SingleThreadedExecutor):  # type: ignore[misc]
    """Keeps its tasks as the executors since ros2/rclpy pull request 1469."""

    def __init__(self, context: rclpy.Context) -> None:
        super().__init__(context=context)
        self._pending_tasks: dict[Task, None] = {}

    def create_task(self, callback: object, *arguments: object) -> Task:
        task = Task(callback, arguments, executor=self)
        self._pending_tasks[task] = None
        return task

    def __getattribute__(self, name: str) -> object:
        if name == "_tasks":
            raise AttributeError(name)
        return super().__getattribute__(name)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        for task in list(self._pending_tasks):
            task()
            del self._pending_tasks[task]


@pytest.fixture
def context() -> Iterator[rclpy.Context]:
    """A context of its own."""
    made = rclpy.Context()
    rclpy.init(context=made)
    yield made
    rclpy.try_shutdown(context=made)


@pytest.mark.parametrize("kind", [SingleThreadedExecutor, LaterExecutor])
def test_a_task_counts_while_it_is_executed(kind: type[Executor], context: rclpy.Context) -> None:
    executor = kind(context=context)
    begun, ends = threading.Event(), threading.Event()

    def work() -> None:
        begun.set()
        ends.wait(patient_s(10.0))

    assert not executes_tasks(executor)
    executor.create_task(work)
    assert not executes_tasks(executor)
    thread = threading.Thread(target=executor.spin_once)
    thread.start()
    try:
        assert begun.wait(patient_s(10.0))
        assert executes_tasks(executor)
    finally:
        ends.set()
        thread.join(patient_s(10.0))
    executor.spin_once(timeout_sec=0.0)
    assert not executes_tasks(executor)


class OlderSubscription:
    """Knows no more than a subscription of Humble does."""

    topic_name = "/counted"


@pytest.mark.parametrize("older", [False, True], ids=["this rclpy", "Humble"])
def test_the_publishers_that_a_subscription_hears_are_counted(
    older: bool, context: rclpy.Context
) -> None:
    node = Node("counts", context=context)
    subscription = node.create_subscription(String, "/counted", lambda _: None, 1)
    for expected in (1, 2):
        node.create_publisher(String, "/counted", 1)
        until_s = time.monotonic() + patient_s(10.0)
        counted, waits = 0, threading.Event()
        while counted != expected and time.monotonic() < until_s:
            counted = publisher_count(node, OlderSubscription() if older else subscription)
            waits.wait(0.01)
        assert counted == expected
