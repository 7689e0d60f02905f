"""Timeout of a navigation client whose server goes silent during a goal."""

from __future__ import annotations

import math

# A server gives feedback at least every 3 s (feedback_rate_hz is 0.5 or more).
SILENCE_S = 5.0
ASK_AGAIN_S = 5.0
LOST_TIMEOUT_S = 10.0
# Fast DDS forgets a participant that is not heard for its lease, 20 s (Fast DDS documentation,
# "DiscoverySettings": leaseDuration). One that goes sooner said goodbye: it has ended.
_GOODBYE_S = 15.0
# While a server that starts is discovered in part, rmw_fastrtps takes the service for none: it
# compares the numbers of request readers and response writers. On a busy machine that lasts.
_GONE_S = 3.0


class ServerWatch:
    """Monitors the server of an active goal; the time is passed in."""

    def __init__(self, lost_timeout_s: float = LOST_TIMEOUT_S) -> None:
        """Use ``lost_timeout_s`` as the timeout of a silent server."""
        self._lost_timeout_s = lost_timeout_s
        self._heard_s = 0.0
        self._ready = True
        self._changed_s = 0.0
        self._left = False
        self._silent = False
        self._ask_s = math.inf

    def hear(self, now_s: float) -> str:
        """Process a sign of life of the server; return a remark if it had been lost."""
        silence_s, silent = now_s - self._heard_s, self._silent
        self._heard_s = now_s
        self._silent = self._left = False
        self._ask_s = math.inf
        return f"The server responds again after {silence_s:.0f} s." if silent else ""

    def look(self, now_s: float, *, ready: bool) -> str:
        """Process the time; return a remark when the silence becomes relevant.

        Args:
            now_s: the time, of any clock that goes steadily.
            ready: whether ROS knows a server of this action.
        """
        silence_s = now_s - self._heard_s
        if ready is not self._ready:
            self._ready = ready
            self._changed_s = now_s
            self._left = not ready and silence_s < _GOODBYE_S
            if ready and self._silent:
                self._ask_s = (
                    now_s  # what the server said meanwhile was lost with the old connection
                )
        if self._silent or silence_s < SILENCE_S:
            return ""
        self._silent = True
        self._ask_s = now_s
        return (
            f"Server silent for {SILENCE_S:.0f} s: it has ended, hangs, or the network "
            f"to it is down. Timeout after {self._lost_timeout_s:g} s."
        )

    def asks_again(self, now_s: float) -> bool:
        """True if the result should be requested again: its answer may be lost."""
        if now_s < self._ask_s:
            return False
        self._ask_s = now_s + ASK_AGAIN_S
        return True

    def verdict(self, now_s: float) -> str:
        """Return why waiting is useless; empty otherwise."""
        silence_s = now_s - self._heard_s
        if self._left and silence_s >= SILENCE_S and now_s - self._changed_s >= _GONE_S:
            return (
                "The server has ended; the vehicle's own failsafe decides what it does now "
                "(docs/navigate.md)."
            )
        if silence_s <= max(self._lost_timeout_s, SILENCE_S):
            return ""
        return (
            f"Server lost: silent for {silence_s:.0f} s. If only the network is "
            "down, the server completes the goal; if it has ended, the vehicle's own failsafe "
            "decides (docs/scaling.md)."
        )
