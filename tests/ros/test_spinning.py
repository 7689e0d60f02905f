"""Executors are stopped in the middle of their work."""

from __future__ import annotations

import gc
import itertools
import time

import pytest
import rclpy
from rclpy.executors import Executor, MultiThreadedExecutor, SingleThreadedExecutor

from drone_navigation.server.spinning import Spinner
from tests.support.processes import patient_s
from tests.support.ros.ros_flight import new_domain

ROUNDS = 20


@pytest.mark.parametrize("threads", [1, 4])
def test_callbacks_that_are_about_to_begin_do_not_fail_at_the_end(
    threads: int, capfd: pytest.CaptureFixture[str]
) -> None:
    context = rclpy.Context()
    rclpy.init(context=context, domain_id=new_domain())
    calls = itertools.count()
    try:
        for _ in range(ROUNDS):
            node = rclpy.create_node("busy", context=context)
            for _ in range(8):
                node.create_timer(1e-4, lambda: next(calls))
            executor: Executor = (
                SingleThreadedExecutor(context=context)
                if threads == 1
                else MultiThreadedExecutor(threads, context=context)
            )
            spinner = Spinner(node, executor)
            spinner.start()
            begun, deadline_s = next(calls), time.monotonic() + patient_s(10.0)
            while next(calls) < begun + 50 and time.monotonic() < deadline_s:
                time.sleep(0.001)
            spinner.stop(10.0)
            node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)
    del executor, spinner, node
    gc.collect()
    assert "never retrieved" not in capfd.readouterr().err
