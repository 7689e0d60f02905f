"""Positions of the target that a goal lands on, for the autopilot. No ROS."""

from __future__ import annotations

import math

from mavlink_vehicle.positions.frames import enu_to_ned, quaternion_inverse, quaternion_turn
from mavlink_vehicle.protocols.streams.landing_target import SeenTarget
from navigation_bridge.goals.active_goal import ActiveGoal
from navigation_bridge.names import LAND_ACTION_NAME
from navigation_bridge.requests.feature import Feature
from navigation_bridge.snapshot import Snapshot
from navigation_core.geometry import subtract
from navigation_core.outcomes import OutcomeCode

__all__ = ["LandingTargets"]

# At most 20 Hz: both firmwares were seen to land with 10 Hz.
_PERIOD_S = 0.05
# An ArduCopter counts each message as a measurement of now.
_AGE_MAX_S = 0.5


class LandingTargets(Feature):
    """Sends what is seen of a target while a goal lands on it."""

    _due_s = -math.inf

    def goal_began(self) -> None:
        """Have turns, if the goal lands on a target."""
        goal = self.parts.goals().active
        lands = goal is not None and goal.kind == LAND_ACTION_NAME and goal.followed is not None
        if lands and self not in self.parts.in_turns:
            self.parts.in_turns.append(self)
        self._due_s = -math.inf

    def goal_ended(self, goal: ActiveGoal, code: OutcomeCode) -> None:
        """Have no more turns, unless another goal lands on a target."""
        active = self.parts.goals().active
        if (active is None or active is goal) and self in self.parts.in_turns:
            self.parts.in_turns.remove(self)

    def is_due(self, now: float) -> bool:
        """Whether a position may be sent."""
        return now >= self._due_s

    def update(self, goal: ActiveGoal | None, snapshot: Snapshot) -> None:
        """Send the target's position, if it is new."""
        target, profile, pose = snapshot.followed, snapshot.profile, snapshot.pose
        rules, now = profile.landing_target, snapshot.time_s
        if target is None or rules is None or pose is None or target.age_s(now) > _AGE_MAX_S:
            return
        away_enu_m = subtract(target.position_enu_m, pose.position_enu_m)
        x, y, z, w = pose.orientation_xyzw
        forward, left, up = quaternion_turn(quaternion_inverse((w, x, y, z)), away_enu_m)
        local_ned_m = enu_to_ned(target.position_enu_m)
        seen = SeenTarget(target.measured_s, local_ned_m, (forward, -left, -up))
        if self.parts.vehicle.landing_target.offer(seen, rules):
            self._due_s = now + _PERIOD_S
