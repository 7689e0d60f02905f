"""Timers that no other clock can stop: everything periodic of ours is done by these."""

from __future__ import annotations

from collections.abc import Callable

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

__all__ = ["steady_timer"]


def steady_timer(
    node: Node, period_s: float, work: Callable[[], None], group: CallbackGroup | None = None
) -> Timer:
    """Create a timer of a node on the machine's monotonic clock.

    A timer on the node's own clock stands still with `use_sim_time` and no `/clock`, while a
    simulation is paused, and for as long as the machine's clock is set back.
    """
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    return node.create_timer(period_s, work, callback_group=group, clock=clock)
