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
from drone_navigation.server import vehicle_node
from drone_navigation.server.vehicle_outputs import VehicleOutputs
from navigation_bridge.goals.goal import GoalFeedback, Output

left_s: dict[int, float] = {}


class Outputs(VehicleOutputs):
    """Notes the time after feedback was handed to DDS, by the position that caused it."""

    _now = 0.0

    def update(self, now: float) -> None:
        """Remember what time it is."""
        self._now = now
        super().update(now)

    def _put_out(self, output: Output) -> None:
        super()._put_out(output)
        position = self._bridge.vehicle.state.global_position
        if isinstance(output, GoalFeedback) and position and position.time_s == self._now:
            left_s[position.time_boot_ms] = time.monotonic()


if __name__ == "__main__":
    vehicle_node.VehicleOutputs = Outputs
    code = navigation_server.main(sys.argv[1:])
    Path(os.environ["BENCH_FEEDBACK_FILE"]).write_text(json.dumps(left_s), encoding="utf-8")
    sys.exit(code)
