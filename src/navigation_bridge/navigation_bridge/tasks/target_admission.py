"""The checks that goals share which have the target of a topic. No ROS."""

from __future__ import annotations

import re

__all__ = ["topic_fault"]

_TARGET_TYPES = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "nav_msgs/msg/Odometry",
)
# Names of topics by ROS 2, without substitutions in braces.
_NAME = re.compile(r"(?:~?/)?[A-Za-z_]\w*(?:/[A-Za-z_]\w*)*", re.ASCII)


def topic_fault(field: str, topic: str, types: tuple[str, ...]) -> str | None:
    """Return why a topic has no poses of a target, as a sentence, or None.

    Args:
        field: of the goal, for the sentence.
        topic: its name.
        types: those with which it is published; empty while nobody publishes it.
    """
    if "__" in topic or not _NAME.fullmatch(topic):
        return f"{field} '{topic}' is no name of a topic."
    others = [name for name in types if name not in _TARGET_TYPES]
    if others:
        names = ", ".join(_TARGET_TYPES)
        return f"{field} '{topic}' is of the type {others[0]}; give one of {names}."
    return None
