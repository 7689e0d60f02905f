"""The messages that PX4 v1.17 streams, and the rates of those that come unasked by link role."""

from __future__ import annotations

ONBOARD_HZ: dict[int, float] = {
    0: 1, 1: 5, 2: 1, 24: 8, 29: 1, 30: 100, 31: 50, 32: 30, 33: 50, 36: 10, 42: 1, 74: 10,
    83: 10, 85: 10, 87: 10, 105: 50, 111: 10, 132: 10, 141: 10, 147: 0.5, 230: 1, 241: 0.5,
    242: 0.5, 245: 5, 331: 30, 360: 5, 436: 0.5, 12901: 1, 12904: 1,
}  # fmt: skip
"""Streams of a companion computer's link (14540), as recorded"""

SCANNER_HZ = {"onboard": 10.0, "gcs": 1.0}
"""OBSTACLE_DISTANCE of a vehicle that has a scanner, as in `Mavlink::configure_streams`; no
recording has it"""

GCS_HZ: dict[int, float] = {
    0: 1, 1: 1, 24: 5, 29: 1, 30: 50, 31: 50, 32: 50, 33: 50, 36: 50, 42: 1, 74: 4,
    83: 50, 85: 50, 87: 50, 132: 0.5, 141: 1, 147: 0.5, 230: 0.5, 231: 0.5, 241: 0.1, 242: 0.5,
    245: 1, 360: 2, 436: 0.5, 12901: 1, 12904: 1,
}  # fmt: skip
"""Streams of a ground station's link (14550), as the real one sends them"""

PING_HZ = {"onboard": 1.0, "gcs": 0.1}


STREAMS = frozenset(
    {
        1, 2, 4, 8, 24, 25, 26, 29, 30, 31, 32, 33, 36, 49, 62, 65, 69, 74, 76, 83, 85, 87, 93,
        105, 106, 111, 112, 115, 116, 124, 129, 132, 137, 141, 143, 147, 148, 149, 192, 225, 230,
        231, 233, 235, 241, 242, 245, 246, 250, 251, 253, 254, 261, 263, 264, 265, 280, 281,
        283, 284, 285, 286, 290, 291, 300, 330, 331, 339, 350, 360, 361, 371, 372, 375, 380, 395,
        397, 435, 436, 10001, 10002, 12900, 12901, 12904, 12918, 12920,
    }
)  # fmt: skip
"""The messages that it has a stream for, by number.

SET_MESSAGE_INTERVAL of these is accepted, whether they ever come or not; of all others it
fails. MISSION_CURRENT (42) is not among them, though it comes once a second: the mission
service sends it. Nor is HEARTBEAT, whose rate nobody may change.
"""
