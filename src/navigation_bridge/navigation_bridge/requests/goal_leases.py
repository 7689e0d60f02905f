"""Leases of goals, by which a goal ends once its client is not heard any more. No ROS."""

from __future__ import annotations

from navigation_bridge.requests.feature import Feature, FeatureParts

__all__ = ["GoalLeases"]

_EARLY_MAX = 16
"""Leases of goals that are not active yet; the oldest are forgotten"""


class GoalLeases(Feature):
    """Passes leases to their goals.

    A goal without a lease continues without its client. One that was leased once ends with
    CLIENT_LOST if the lease is not renewed (`judge_lease` in rules/goal_rules.py).
    """

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a lease."""
        super().__init__(parts)
        self._early: dict[str, float] = {}

    def renew(self, goal_id: str, now: float) -> None:
        """Process a lease, which may come before its goal.

        Args:
            goal_id: UUID of the goal as hexadecimal digits.
            now: time in seconds.
        """
        goal = self.parts.goals().active
        if goal is not None and goal.goal_id == goal_id:
            goal.lease.renew(now)
            return
        self._early.pop(goal_id, None)
        self._early[goal_id] = now
        if len(self._early) > _EARLY_MAX:
            del self._early[next(iter(self._early))]

    def goal_began(self) -> None:
        """Give the goal its lease, if that was there first."""
        goal = self.parts.goals().active
        if goal is not None and goal.goal_id in self._early:
            goal.lease.renew(self._early.pop(goal.goal_id))
