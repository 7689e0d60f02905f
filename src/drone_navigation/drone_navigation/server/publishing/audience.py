"""Whether anyone gets what is published: most of what streams need not be made."""

from __future__ import annotations

import math

from drone_navigation.server.publishing.publishing_node import TopicPublisher

__all__ = ["Audience"]

# The question takes ROS longer than many a message. A subscriber misses the stream for this long
# at most, which is less than its discovery takes.
_ASKED_AFTER_S = 0.25


class Audience:
    """The subscribers of one publisher, counted now and then."""

    def __init__(self, publisher: TopicPublisher) -> None:
        """Count those of a publisher."""
        self._publisher = publisher
        self._asked_s = math.inf
        self._is_there = False

    def is_there(self, now: float) -> bool:
        """Return whether there were any when they were counted last."""
        # A recording that is played again begins earlier.
        if not self._asked_s <= now < self._asked_s + _ASKED_AFTER_S:
            self._asked_s = now
            self._is_there = bool(self._publisher.get_subscription_count())
        return self._is_there
