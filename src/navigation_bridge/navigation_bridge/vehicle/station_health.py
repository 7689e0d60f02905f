"""What ground stations send on one of their links, and what of it was dropped and why. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field

from mavlink_vehicle.io.endpoints import LinkStatistics

COUNTS = {
    "frames": "messages received since start",
    "unknown": "messages of unknown kind since start",
    "forwarded": "passed on since start",
    "sent": "sent there since start",
    "unsent": "could not be sent there since start",
    "lost_total": "lost since start",
    "bad_crc": "bad checksums since start",
    "bytes_dropped": "bytes outside frames since start",
    "unrouted": "for systems not heard since start",
    "looped": "our own that came back since start",
    "duplicates": "duplicates since start",
    "spoofed": "in the name of a vehicle since start",
    "throttled": "too many since start",
    "withheld": "too many to be passed on there since start",
    "unsigned": "unsigned messages since start",
    "badly_signed": "wrongly signed messages since start",
    "replayed": "replayed messages since start",
}
"""What is counted, by its name in `LinkStatistics`, and how people are told."""

_TROUBLE = {
    "spoofed": "A ground station speaks in the name of a vehicle",
    "throttled": "A ground station sends too much",
    "withheld": "More is to be passed on than can be",
    "unsigned": "Unsigned messages are dropped",
    "badly_signed": "Wrongly signed messages are dropped",
    "replayed": "Replayed messages are dropped",
    "bad_crc": "What comes is damaged, or no MAVLink",
    "bytes_dropped": "What comes is damaged, or no MAVLink",
}


@dataclass
class StationHealth:
    """Counts of a link to ground stations.

    Attributes:
        trouble: what is wrong since the last update, as a sentence; empty when nothing is.
        message: a sentence for people.
        values: all counts, by their names for people.
    """

    trouble: str = ""
    message: str = ""
    values: dict[str, str] = field(default_factory=dict)
    _counts: dict[str, int] = field(default_factory=dict)

    def update(self, statistics: LinkStatistics) -> None:
        """Take the counts of this moment; a period ends here."""
        counts = {name: int(getattr(statistics, name)) for name in COUNTS}
        before = self._counts or dict.fromkeys(COUNTS, 0)
        grown = [what for name, what in _TROUBLE.items() if counts[name] > before[name]]
        heard = counts["frames"] > before["frames"]
        self._counts = counts
        self.trouble = grown[0] if grown else ""
        self.message = self.trouble or ("Ground stations are heard" if heard else "Silent")
        self.values = {COUNTS[name]: str(number) for name, number in counts.items()}
