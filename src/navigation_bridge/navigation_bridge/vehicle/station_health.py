"""Traffic counts of a ground station link, with the reasons of drops. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field

from mavlink_vehicle.io.endpoints import LinkStatistics

COUNTS = {
    "frames": "messages received since start",
    "unknown": "unknown messages since start",
    "forwarded": "forwarded since start",
    "sent": "sent since start",
    "unsent": "send failures since start",
    "lost_total": "lost since start",
    "bad_crc": "bad checksums since start",
    "bytes_dropped": "bytes outside frames since start",
    "unrouted": "for unknown systems since start",
    "beyond_mavlink_1": "without a form in MAVLink 1 since start",
    "looped": "looped back since start",
    "duplicates": "duplicates since start",
    "spoofed": "spoofed since start",
    "throttled": "over the rate limit since start",
    "withheld": "withheld by the rate limit since start",
    "unsigned": "unsigned messages since start",
    "badly_signed": "wrongly signed messages since start",
    "replayed": "replayed messages since start",
}
"""Counts by their names in `LinkStatistics`, with their names for people."""

_TROUBLE = {
    "spoofed": "A ground station uses a vehicle's system id",
    "throttled": "A ground station exceeds the rate limit",
    "withheld": "More traffic than can be forwarded",
    "unsigned": "Unsigned messages are dropped",
    "badly_signed": "Wrongly signed messages are dropped",
    "replayed": "Replayed messages are dropped",
    "bad_crc": "Received data is corrupted or not MAVLink",
    "bytes_dropped": "Received data is corrupted or not MAVLink",
}


@dataclass
class StationHealth:
    """Counts of a link to ground stations.

    Attributes:
        trouble: a sentence about problems since the last update; empty if none.
        message: a sentence for people.
        values: all counts, by their names for people.
    """

    trouble: str = ""
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    _counts: dict[str, int] = field(default_factory=dict)

    def update(self, statistics: LinkStatistics) -> None:
        """Update from the current counts; this ends the period."""
        counts = {name: int(getattr(statistics, name)) for name in COUNTS}
        before = self._counts or dict.fromkeys(COUNTS, 0)
        grown = [what for name, what in _TROUBLE.items() if counts[name] > before[name]]
        heard = counts["frames"] > before["frames"]
        self._counts = counts
        self.trouble = grown[0] if grown else ""
        self.message = self.trouble or ("Ground stations connected" if heard else "Silent")
        self.values = {COUNTS[name]: str(number) for name, number in counts.items()}
