"""Envelope of a flight: how far, high, fast and long it goes, and what is left then. No I/O."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from navigation_bridge.configuration.checked_values import member, number
from navigation_core.geometry import Vector3, distance

__all__ = ["ActEnvelope", "FlightExtent", "breaches", "extent_of"]

_SPEED_OVER_S = 1.0
"""Points of a rehearsal are rounded: a speed is taken over at least this time"""
_NUMBER = number(0, 1e6)


@dataclass(frozen=True)
class ActEnvelope:
    """Limits of a flight; all are given, so that none is forgotten."""

    radius_m: float = member(_NUMBER, text="from the map origin, horizontally")
    height_min_m: float = member(number(-1000, 1e6), text="above the map origin")
    height_max_m: float = member(number(-1000, 1e6), text="above the map origin")
    speed_max_m_s: float = member(_NUMBER)
    duration_max_s: float = member(_NUMBER)
    battery_min_percent: float = member(number(0, 100), text="at the end; 0: none")
    clearance_min_m: float = member(_NUMBER, text="of the hull from known and sensed obstacles")

    def value(self) -> dict[str, float]:
        """Return it for JSON."""
        return asdict(self)


@dataclass(frozen=True)
class FlightExtent:
    """Extent of a rehearsed flight.

    Attributes:
        radius_m: largest horizontal distance from the map origin.
        height_min_m: above the map origin.
        height_max_m: above the map origin.
        speed_max_m_s: over ground.
        duration_s: from the goal to its end.
        battery_percent: at the end; None if nothing supports a number.
        clearance_m: of the hull from obstacles; None where none are known.
    """

    radius_m: float
    height_min_m: float
    height_max_m: float
    speed_max_m_s: float
    duration_s: float
    battery_percent: float | None
    clearance_m: float | None

    def value(self) -> dict[str, float | None]:
        """Return it for JSON."""
        return {k: None if v is None else round(v, 1) for k, v in asdict(self).items()}

    @property
    def sentence(self) -> str:
        """For people."""
        battery = "unknown" if self.battery_percent is None else f"{self.battery_percent:.0f} %"
        clear = "no obstacles known" if self.clearance_m is None else f"{self.clearance_m:.1f} m"
        return (
            f"within {self.radius_m:.1f} m of the map origin, {self.height_min_m:.1f} to "
            f"{self.height_max_m:.1f} m high, at most {self.speed_max_m_s:.1f} m/s, "
            f"{self.duration_s:.0f} s, battery at the end {battery}, clearance {clear}"
        )


def extent_of(rehearsal: Mapping[str, Any]) -> FlightExtent:
    """Return the extent of what `flight_rehearsal` has flown; `Rehearsal` has its members."""
    path: Sequence[Vector3] = rehearsal["path_enu_m"]
    approach, battery = rehearsal["approach"], rehearsal["battery"]
    return FlightExtent(
        radius_m=max(math.hypot(east, north) for east, north, _ in path),
        height_min_m=min(up for _, _, up in path),
        height_max_m=max(up for _, _, up in path),
        speed_max_m_s=_fastest(path, rehearsal["times_s"]),
        duration_s=rehearsal["duration_s"],
        battery_percent=None if battery is None else 100.0 * battery,
        clearance_m=None if approach is None else approach["clearance_m"],
    )


def _fastest(path: Sequence[Vector3], times_s: Sequence[float]) -> float:
    """Return the highest ground speed, over stretches of at least a second."""
    fastest, first = 0.0, 0
    for last in range(1, len(path)):
        while first + 1 < last and times_s[last] - times_s[first + 1] >= _SPEED_OVER_S:
            first += 1
        took_s = times_s[last] - times_s[first]
        if took_s >= _SPEED_OVER_S or last == len(path) - 1:
            (x0, y0, _), (x1, y1, _) = path[first], path[last]
            moved_m = distance((x0, y0, 0.0), (x1, y1, 0.0))
            fastest = max(fastest, moved_m / max(took_s, _SPEED_OVER_S))
    return fastest


def breaches(extent: FlightExtent, envelope: ActEnvelope) -> tuple[str, ...]:
    """Return a sentence for each limit that a flight does not keep.

    An unknown battery keeps the limit 0 only. A clearance is unknown only where no obstacles are
    known, and keeps all.
    """
    battery = extent.battery_percent
    clearance_m = math.inf if extent.clearance_m is None else extent.clearance_m
    checks = (
        (extent.radius_m <= envelope.radius_m, f"radius {extent.radius_m:.1f} m"),
        (extent.height_min_m >= envelope.height_min_m, f"height {extent.height_min_m:.1f} m"),
        (extent.height_max_m <= envelope.height_max_m, f"height {extent.height_max_m:.1f} m"),
        (extent.speed_max_m_s <= envelope.speed_max_m_s, f"speed {extent.speed_max_m_s:.1f} m/s"),
        (extent.duration_s <= envelope.duration_max_s, f"duration {extent.duration_s:.0f} s"),
        (
            envelope.battery_min_percent <= (0.0 if battery is None else battery),
            "battery unknown" if battery is None else f"battery {battery:.0f} %",
        ),
        (clearance_m >= envelope.clearance_min_m, f"clearance {clearance_m:.1f} m"),
    )
    return tuple(text for kept, text in checks if not kept)
