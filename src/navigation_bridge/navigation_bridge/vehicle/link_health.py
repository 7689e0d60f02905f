"""Health of the vehicle's link: rates, losses and latency. No ROS."""

from __future__ import annotations

from dataclasses import dataclass, field

from mavlink_vehicle.io.endpoints import LinkStatistics
from mavlink_vehicle.vehicle import Vehicle


@dataclass
class LinkHealth:
    """Link statistics of the last period and since the start.

    Attributes:
        loss_share: share of the messages of the last period that were lost.
        values: all figures, by their names for people.
    """

    LOSS_WARNING = 0.1

    loss_share: float = 0.0
    values: dict[str, str] = field(default_factory=dict)
    _frames: int = 0
    _lost: int = 0
    _time_s: float | None = None

    def update(self, vehicle: Vehicle, statistics: LinkStatistics, now: float) -> None:
        """Update from the current counts; this ends the period."""
        frames, lost = statistics.frames - self._frames, statistics.lost_total - self._lost
        period_s = None if self._time_s is None else now - self._time_s
        self._frames, self._lost, self._time_s = statistics.frames, statistics.lost_total, now
        self.loss_share = lost / (frames + lost) if frames + lost > 0 else 0.0
        heard_s = vehicle.state.last_heartbeat_s
        round_trip_s = vehicle.timesync.round_trip_s
        self.values = {
            "messages per second": "unknown" if not period_s else f"{frames / period_s:.1f}",
            "lost": f"{100.0 * self.loss_share:.1f} %",
            "lost since start": str(statistics.lost_total),
            "bad checksums since start": str(statistics.bad_crc),
            "bytes outside frames since start": str(statistics.bytes_dropped),
            "unknown messages since start": str(statistics.unknown),
            "unsigned messages since start": str(statistics.unsigned),
            "wrongly signed messages since start": str(statistics.badly_signed),
            "replayed messages since start": str(statistics.replayed),
            "duplicate messages since start": str(statistics.duplicates),
            "messages over the rate limit since start": str(statistics.throttled),
            "last HEARTBEAT": "never" if heard_s is None else f"{now - heard_s:.1f} s ago",
            "round trip": "unknown" if round_trip_s is None else f"{1000.0 * round_trip_s:.1f} ms",
            "one way": "yes" if vehicle.answers.one_way else "no",
            "rejected message requests": ", ".join(sorted(vehicle.rates.refusals)) or "none",
        }
