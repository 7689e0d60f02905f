"""The navigation server, with a note of when the feedback to each position had left.

Run like ``navigation_server``; the environment variable BENCH_FEEDBACK_FILE names the file
that gets {time_boot_ms: seconds of the monotonic clock} as JSON when the server stops.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

from drone_navigation import navigation_server
from drone_navigation.server import vehicle_application, vehicle_node
from mavlink_vehicle.codec import Message
from navigation_bridge.goals.goal import GoalFeedback, Output

left_s: dict[int, float] = {}


class Application(vehicle_application.VehicleApplication):
    """Notes the time after feedback was handed to DDS, by the position that caused it."""

    _position_ms: int | None = None

    def receive(self, message: Message, now: float) -> None:
        """Remember which position is being worked on."""
        if message.get_type() == "GLOBAL_POSITION_INT":
            self._position_ms = message.time_boot_ms
        super().receive(message, now)
        self._position_ms = None

    def _put_out(self, output: Output) -> None:
        super()._put_out(output)
        if isinstance(output, GoalFeedback) and self._position_ms is not None:
            left_s[self._position_ms] = time.monotonic()


if __name__ == "__main__":
    vehicle_node.VehicleApplication = Application
    code = navigation_server.main(sys.argv[1:])
    Path(os.environ["BENCH_FEEDBACK_FILE"]).write_text(json.dumps(left_s), encoding="utf-8")
    sys.exit(code)
