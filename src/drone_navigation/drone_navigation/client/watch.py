"""How long a navigation client has heard nothing of its goal, and what follows from that."""

from __future__ import annotations

import math

# A server gives feedback at least every 3 s (feedback_rate_hz is 0.5 or more).
SILENCE_S = 5.0
ASK_AGAIN_S = 5.0
LOST_TIMEOUT_S = 30.0
# Fast DDS forgets a participant that is not heard for its lease, 20 s (Fast DDS documentation,
# "DiscoverySettings": leaseDuration). One that goes sooner said goodbye: it has ended.
_GOODBYE_S = 15.0


class ServerWatch:
    """Keeps an eye on the server of a goal that is under way; told the time, reads no clock."""

    def __init__(self, lost_timeout_s: float = LOST_TIMEOUT_S) -> None:
        """Wait no longer than ``lost_timeout_s`` for a server that is not heard."""
        self._lost_timeout_s = lost_timeout_s
        self._heard_s = 0.0
        self._ready = True
        self._left = False
        self._silent = False
        self._ask_s = math.inf

    def hear(self, now_s: float) -> str:
        """Take note of a word from the server; return a remark if that was no longer expected."""
        silence_s, silent = now_s - self._heard_s, self._silent
        self._heard_s = now_s
        self._silent = self._left = False
        self._ask_s = math.inf
        return f"The server is heard again, after {silence_s:.0f} s." if silent else ""

    def look(self, now_s: float, *, ready: bool) -> str:
        """Take note of the time; return a remark when the silence begins to matter.

        Args:
            now_s: the time, of any clock that goes steadily.
            ready: whether ROS knows a server of this action.
        """
        silence_s = now_s - self._heard_s
        if ready is not self._ready:
            self._ready = ready
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
            f"No word from the server for {SILENCE_S:.0f} s: it has ended, hangs, or the network "
            f"to it is cut. Waiting for it, {self._lost_timeout_s:g} s in all."
        )

    def asks_again(self, now_s: float) -> bool:
        """Whether the server is to be asked for the end once more: its answer may be lost."""
        if now_s < self._ask_s:
            return False
        self._ask_s = now_s + ASK_AGAIN_S
        return True

    def verdict(self, now_s: float) -> str:
        """Return why there is no use in waiting any longer; empty while there is."""
        silence_s = now_s - self._heard_s
        if self._left and silence_s >= SILENCE_S:
            return (
                "The server has ended; what the vehicle does now is its own failsafe's business "
                "(docs/navigate.md)."
            )
        if silence_s <= max(self._lost_timeout_s, SILENCE_S):
            return ""
        return (
            f"The server is gone: no word from it for {silence_s:.0f} s. If only the network is "
            "cut, it flies the goal to its end; if it has ended, the vehicle's own failsafe "
            "decides (docs/scaling.md)."
        )
