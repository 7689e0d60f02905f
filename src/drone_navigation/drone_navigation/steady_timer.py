"""Timers that no other clock can stop, and the turns of an executor that they give."""

from __future__ import annotations

from collections.abc import Callable, Generator

from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.timer import Timer

__all__ = ["NextTurn", "steady_timer"]


def steady_timer(
    node: Node, period_s: float, work: Callable[[], None], group: CallbackGroup | None = None
) -> Timer:
    """Create a timer of a node on the machine's monotonic clock.

    A timer on the node's own clock stands still with `use_sim_time` and no `/clock`, while a
    simulation is paused, and for as long as the machine's clock is set back.
    """
    clock = Clock(clock_type=ClockType.STEADY_TIME)
    return node.create_timer(period_s, work, callback_group=group, clock=clock)


class NextTurn:
    """Waits for the next turn of the executor, in a coroutine of an action."""

    def __await__(self) -> Generator[None, None, None]:
        """Yield once."""
        yield
