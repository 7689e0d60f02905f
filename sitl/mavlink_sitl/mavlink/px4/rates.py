"""The rates of unrequested PX4 messages, by message id and link role."""

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
