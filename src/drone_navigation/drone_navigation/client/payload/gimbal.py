"""The command ``navigation_client point``: the gimbal."""

from __future__ import annotations

import argparse
import math
from typing import Any

from rclpy.action import ActionClient

from custom_interfaces.action import PointGimbal
from drone_navigation.client.commands import ClientCommand, run_command
from drone_navigation.client.options import (
    EXIT_ABORTED,
    EXIT_NO_SERVER,
    EXIT_REJECTED,
    EXIT_SUCCESS,
)
from navigation_bridge.names import POINT_GIMBAL_ACTION_NAME

__all__ = ["point_goal", "run_point"]

# The server waits 45 s for the vehicle's answer and 20 s for the gimbal.
_RESULT_TIMEOUT_S = 75.0


def run_point(options: argparse.Namespace, argv: list[str]) -> int:
    """Point the gimbal and return the exit code."""
    return run_command(options, argv, _PointCommand)


def point_goal(options: argparse.Namespace) -> PointGimbal.Goal:
    """Return the goal of the command line."""
    goal = PointGimbal.Goal()
    if options.release:
        goal.mode = goal.NONE
    elif options.system is not None:
        goal.mode, goal.system_id = goal.VEHICLE, options.system
    elif options.at is not None:
        goal.mode = goal.POINT
        goal.target.header.frame_id = options.frame
        goal.target.point.x, goal.target.point.y, goal.target.point.z = options.at
    else:
        goal.mode, goal.yaw_locked = goal.ANGLE, options.locked
        pitch_deg, yaw_deg = options.angle
        goal.pitch, goal.yaw = math.radians(pitch_deg), math.radians(yaw_deg)
    return goal


class _PointCommand(ClientCommand):
    """One goal, from finding the server to its result."""

    def run(self) -> int:
        """Send the goal and show the result."""
        client = ActionClient(self._node, PointGimbal, POINT_GIMBAL_ACTION_NAME)
        if not self._wait(client.server_is_ready, self._options.server_timeout):
            return self._no_server("trigger_camera")
        sent = client.send_goal_async(point_goal(self._options))
        if not self._wait_for_answer(sent.done, _RESULT_TIMEOUT_S, client.server_is_ready):
            return EXIT_NO_SERVER
        handle: Any = sent.result()
        if not handle.accepted:
            self._tell({"success": False, "message": "Rejected."}, "Rejected.")
            return EXIT_REJECTED
        ended = handle.get_result_async()
        try:
            if not self._wait_for_answer(ended.done, _RESULT_TIMEOUT_S, client.server_is_ready):
                return EXIT_NO_SERVER
        except KeyboardInterrupt:
            handle.cancel_goal_async()
            raise
        result = ended.result().result
        self._tell({"success": result.success, "message": result.message}, result.message)
        return EXIT_SUCCESS if result.success else EXIT_ABORTED
