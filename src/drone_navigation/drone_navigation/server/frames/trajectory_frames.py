"""The frames of TF in which trajectories of other programs are given."""

from __future__ import annotations

import math
import time

from rclpy.node import Node

from drone_navigation.server.frame_names import FrameNames
from drone_navigation.server.frames.transform_listener import TransformListener
from drone_navigation.server.frames.transform_tree import Placed
from mavlink_vehicle.positions.frames import quaternion_inverse, quaternion_multiply

__all__ = ["TrajectoryFrames"]

# For this long after it has begun to listen, a transform that is missing is waited for.
_WAIT_S, _LOOK_S = 1.5, 0.1
# A transform that is older than this is not used.
_OLD_S = 2.0
# Within this time, a frame that stands still moves and turns by less than this.
_STILL_S, _STILL_M, _STILL_RAD = 1.0, 0.2, math.radians(5.0)


class TrajectoryFrames:
    """Looks frames up in ``/tf`` and ``/tf_static``, which are heard from the first look on."""

    def __init__(self, node: Node, frames: FrameNames) -> None:
        """Prepare; nothing is heard yet."""
        self._node, self._frames = node, frames
        self._listener = TransformListener(node)
        self._begun_s = -math.inf

    def axes(self, frame_id: str, stamp_s: float) -> Placed | str:
        """Return the pose of a frame in this vehicle's map, or why it has none.

        Waits for it, at most for a moment, if nothing was heard before.

        Args:
            frame_id: name of the frame; the prefix of the vehicle's own ones is optional.
            stamp_s: time at which it is wanted; 0 for the newest.
        """
        if self._listener.listen():
            self._begun_s = time.monotonic()
        own = self._frames.prefix + self._frames.plain(frame_id)
        frame = own if self._frames.is_own(own) else frame_id
        while True:
            found, heard_s = self._look(frame, stamp_s), time.monotonic() - self._begun_s
            if isinstance(found, str):
                waits = heard_s < _WAIT_S
            else:  # whether it moves is known after a while only
                waits = found.stamp_s < math.inf and heard_s < _STILL_S
            if not waits:
                return found
            self._listener.wait(_LOOK_S)

    def _look(self, frame: str, stamp_s: float) -> Placed | str:
        listener, target = self._listener, self._frames.map
        newest = listener.pose(frame, target)
        placed = listener.pose(frame, target, stamp_s) if stamp_s else newest
        if newest is None or placed is None:
            return f"There is no transform from '{frame}' to '{target}'."
        if newest.stamp_s == math.inf:
            return placed
        now_s = 1e-9 * self._node.get_clock().now().nanoseconds
        age_s = now_s - newest.stamp_s
        if age_s > _OLD_S:
            return f"The last transform from '{frame}' to '{target}' is {age_s:.1f} s old."
        before = listener.pose(frame, target, newest.stamp_s - _STILL_S)
        if before is None:
            return placed
        moved_m = math.dist(newest.position, before.position)
        turn = quaternion_multiply(quaternion_inverse(before.turn), newest.turn)
        turned_rad = 2.0 * math.acos(min(abs(turn[0]), 1.0))
        if moved_m > _STILL_M or turned_rad > _STILL_RAD:
            return (
                f"'{frame}' moves in '{target}': {moved_m:.2f} m and "
                f"{math.degrees(turned_rad):.0f} degrees in the last {_STILL_S:g} s."
            )
        return placed
