"""Runs a module whose wall clock is set by a signal: ``python stepped_clock.py MODULE ...``.

Each SIGUSR1 sets the clock to the next of `OFFSETS_S` from the machine's. It is the clock that
Python sees: `time.time`, `time.time_ns` and the ROS and system clocks of rclpy. The machine's own
clock, and the C++ below rclpy, stay as they are.
"""

from __future__ import annotations

import itertools
import runpy
import signal
import sys
import time
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.time import Time

OFFSETS_S = (-3600, 86_400, 0)
"""An hour back, then a day ahead, then right"""


class SteppedClock:
    """The wall clock of this process."""

    def __init__(self) -> None:
        """Take the place of the clocks; they are right at first."""
        self._offset_ns = 0
        self._next_s = itertools.cycle(OFFSETS_S)
        real_ns, real_now = time.time_ns, Clock.now

        def time_ns() -> int:
            return real_ns() + self._offset_ns

        def now(clock: Clock) -> Time:
            told = real_now(clock)
            if clock.clock_type is ClockType.STEADY_TIME:
                return told
            shifted_ns = told.nanoseconds + self._offset_ns
            return Time(nanoseconds=shifted_ns, clock_type=clock.clock_type)

        time.time_ns, time.time = time_ns, lambda: 1e-9 * time_ns()
        Clock.now = now

    def step(self, *_: Any) -> None:
        """Set it."""
        offset_s = next(self._next_s)
        self._offset_ns = offset_s * 1_000_000_000
        print(f"The clock is {offset_s:+d} s off.", flush=True)


if __name__ == "__main__":
    signal.signal(signal.SIGUSR1, SteppedClock().step)
    sys.path.pop(0)
    sys.argv.pop(0)
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
