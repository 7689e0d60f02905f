"""A target that a vehicle of an exploration follows: its motion, and what is measured of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from navigation_bridge.goals.requests import TargetSource
from navigation_bridge.tasks.followed_target import FollowedTarget
from navigation_core.geometry import Vector3
from navigation_core.tasks.inputs.tracked_target import TargetSample
from tests.explore.exploration import Ship

__all__ = ["SOURCE", "MovingTarget"]

SOURCE = TargetSource(topic="/target")
_PERIOD_S = 0.1


@dataclass
class MovingTarget:
    """A target; it is measured at 10 Hz while a server follows it.

    Attributes:
        ship: the vehicle, whose map it is in.
        begun_s: beginning of its motion.
        start_enu_m: position at that time.
        velocity_enu_m_s: velocity until it stands.
        stands_s: time from the beginning after which it stands.
        lost_s: time from the beginning after which it is not measured any more.
        lie: what its samples are wrong by: "", "nan", "old" or "far".
    """

    ship: Ship
    begun_s: float
    start_enu_m: Vector3
    velocity_enu_m_s: Vector3
    stands_s: float
    lost_s: float
    lie: str = ""
    _due_s: float = -math.inf

    def position_enu_m(self, now_s: float) -> Vector3:
        """Return where it truly is."""
        moved_s = min(now_s - self.begun_s, self.stands_s)
        x, y, z = (
            place + speed * moved_s
            for place, speed in zip(self.start_enu_m, self.velocity_enu_m_s, strict=True)
        )
        return (x, y, z)

    def turn(self) -> None:
        """Measure it, if that is due."""
        now_s, server = self.ship.now_s, self.ship.server
        if server is None or now_s < self._due_s or now_s < server.stalled_until_s:
            return
        self._due_s = now_s + _PERIOD_S - 1e-9
        feature = server.bridge.feature(FollowedTarget)
        if feature.source != SOURCE:
            return
        position = self.position_enu_m(now_s)
        self.ship.log("target", position)
        if now_s - self.begun_s > self.lost_s:
            return
        measured_s = now_s - 3600.0 if self.lie == "old" else now_s
        if self.lie == "nan":
            position = (math.nan, position[1], position[2])
        elif self.lie == "far":
            position = (position[0] + 1e5, position[1], position[2])
        feature.offer(SOURCE, TargetSample(measured_s, position), now_s)
