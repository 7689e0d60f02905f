"""A tree of frames as ``/tf`` and ``/tf_static`` describe it. No ROS."""

from __future__ import annotations

import bisect
import math
from collections import deque
from dataclasses import dataclass

from mavlink_vehicle.positions.frames import (
    Quaternion,
    quaternion_inverse,
    quaternion_multiply,
    quaternion_turn,
)
from navigation_core.geometry import Vector3, add, is_finite, scale, subtract

__all__ = ["Placed", "TransformTree"]

# Moving transforms are kept for this time, and at most as many frames in all; a chain is no longer.
_KEPT_S, _KEPT_MAX, _FRAMES_MAX, _DEPTH_MAX = 3.0, 400, 1000, 50
# A quaternion whose norm differs by more from 1 is none.
_NORM_TOLERANCE = 0.1


@dataclass(frozen=True)
class Placed:
    """The pose of a frame in another.

    Attributes:
        position: in the other's axes, in metres.
        turn: quaternion w, x, y, z from its axes into the other's.
        stamp_s: time of the oldest moving transform that it is made of; infinite without one.
    """

    position: Vector3 = (0.0, 0.0, 0.0)
    turn: Quaternion = (1.0, 0.0, 0.0, 0.0)
    stamp_s: float = math.inf

    def of(self, position: Vector3) -> Vector3:
        """Return a position of the frame in the other."""
        return add(self.position, quaternion_turn(self.turn, position))

    def then(self, outer: Placed) -> Placed:
        """Return the pose in the frame that the other is placed in."""
        turn = quaternion_multiply(outer.turn, self.turn)
        return Placed(outer.of(self.position), turn, min(self.stamp_s, outer.stamp_s))

    @property
    def inverse(self) -> Placed:
        """The pose of the other in this frame."""
        back = quaternion_inverse(self.turn)
        return Placed(scale(quaternion_turn(back, self.position), -1.0), back, self.stamp_s)

    @property
    def is_sound(self) -> bool:
        """Whether its numbers can be a pose."""
        norm = math.sqrt(sum(part * part for part in self.turn))
        return is_finite(self.position) and abs(norm - 1.0) <= _NORM_TOLERANCE


class TransformTree:
    """Keeps transforms, the moving ones for some seconds, and joins them."""

    def __init__(self) -> None:
        """Begin without a transform."""
        self._parents: dict[str, str] = {}
        self._placed: dict[str, deque[Placed]] = {}

    def take(self, child: str, parent: str, placed: Placed) -> None:
        """Process a transform; one that cannot be a pose is ignored.

        Args:
            child: name of a frame.
            parent: name of the frame that it is placed in.
            placed: its pose; its stamp is infinite if it stands still.
        """
        child, parent = child.lstrip("/"), parent.lstrip("/")
        is_full = child not in self._parents and len(self._parents) >= _FRAMES_MAX
        if not placed.is_sound or is_full or math.isnan(placed.stamp_s):
            return
        kept = self._placed.get(child)
        if kept is None or self._parents[child] != parent or placed.stamp_s == math.inf:
            kept = self._placed[child] = deque(maxlen=_KEPT_MAX)
        self._parents[child] = parent
        if kept and placed.stamp_s <= kept[-1].stamp_s:
            if placed.stamp_s > kept[-1].stamp_s - _KEPT_S:
                return  # late, or repeated
            kept.clear()  # the clock was set back
        kept.append(placed)
        while kept[-1].stamp_s - kept[0].stamp_s > _KEPT_S:
            kept.popleft()

    def pose(self, frame: str, target: str, at_s: float | None = None) -> Placed | None:
        """Return the pose of a frame in another; None while they are not joined.

        Args:
            frame: name of the frame.
            target: name of the other.
            at_s: time of the moving transforms; None for the newest of each.
        """
        up, down = self._chain(frame.lstrip("/"), at_s), self._chain(target.lstrip("/"), at_s)
        for common, placed in up.items():
            if common in down:
                return placed.then(down[common].inverse)
        return None

    def _chain(self, frame: str, at_s: float | None) -> dict[str, Placed]:
        """Return the pose of a frame in itself, its parent, and so on."""
        placed, chain = Placed(), {frame: Placed()}
        while frame in self._parents and len(chain) < _DEPTH_MAX:
            placed = placed.then(self._at(self._placed[frame], at_s))
            frame = self._parents[frame]
            if frame in chain:
                break
            chain[frame] = placed
        return chain

    def _at(self, kept: deque[Placed], at_s: float | None) -> Placed:
        """Return the transform at a time, between the two around it; else the nearest."""
        if at_s is None or at_s >= kept[-1].stamp_s:
            return kept[-1]
        row = bisect.bisect_left([each.stamp_s for each in kept], at_s)
        if row == 0:
            return kept[0]
        before, after = kept[row - 1], kept[row]
        if math.isinf(after.stamp_s):
            return after
        share = (at_s - before.stamp_s) / (after.stamp_s - before.stamp_s)
        position = add(before.position, scale(subtract(after.position, before.position), share))
        return Placed(position, (after if share > 0.5 else before).turn, at_s)
