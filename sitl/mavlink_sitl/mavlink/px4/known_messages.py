"""The messages that PX4 v1.17 has a stream for, by number.

SET_MESSAGE_INTERVAL of these is accepted, whether they ever come or not; of all others it
fails. MISSION_CURRENT (42) is not among them, though it comes once a second: the mission
service sends it. Nor is HEARTBEAT, whose rate nobody may change.
"""

from __future__ import annotations

STREAMS = frozenset(
    {
        1, 2, 4, 8, 24, 25, 26, 29, 30, 31, 32, 33, 36, 49, 62, 65, 69, 74, 76, 83, 85, 87, 93,
        105, 106, 111, 112, 115, 116, 124, 129, 132, 137, 141, 143, 147, 148, 149, 192, 225, 230,
        231, 233, 235, 241, 242, 245, 246, 250, 251, 253, 254, 261, 263, 264, 265, 280, 281,
        283, 284, 285, 286, 290, 291, 300, 330, 331, 339, 350, 360, 361, 371, 372, 375, 380, 395,
        397, 435, 436, 10001, 10002, 12900, 12901, 12904, 12918, 12920,
    }
)  # fmt: skip
