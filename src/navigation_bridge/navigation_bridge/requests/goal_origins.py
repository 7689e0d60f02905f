"""Names that clients give themselves for their goals. No ROS."""

from __future__ import annotations

from navigation_bridge.goals.goal import LogLevel
from navigation_bridge.requests.feature import Feature, FeatureParts

__all__ = ["ORIGIN_MAX", "GoalOrigins"]

ORIGIN_MAX = 100
"""Characters of a name; the rest is left out"""


class GoalOrigins(Feature):
    """Reports who says to have sent the active goal, once for each goal.

    An action's goal has no sender. The name is a claim: any client may make it.
    """

    def __init__(self, parts: FeatureParts) -> None:
        """Begin without a name."""
        super().__init__(parts)
        self._named_id = ""

    def name(self, goal_id: str, origin: str) -> None:
        """Report a name; nothing for a goal that is not active, or has one.

        Args:
            goal_id: UUID of the goal as hexadecimal digits.
            origin: the name; what is not printable ASCII is replaced.
        """
        goal = self.parts.goals().active
        if goal is None or goal.goal_id != goal_id or goal_id == self._named_id:
            return
        self._named_id = goal_id
        plain = "".join(c if " " <= c <= "~" else "?" for c in origin[:ORIGIN_MAX])
        text = f"Sent by {plain}."
        self.parts.report.remark(goal, text)
        self.parts.report.log(LogLevel.INFO, f"Goal {goal.short_id}: {text}")
