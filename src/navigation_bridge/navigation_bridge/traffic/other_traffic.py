"""Others in the air: what an ADS-B receiver or anybody else sees. No ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.positions.projections import Geodetic
from navigation_core.traffic.intruders import Intruder
from navigation_core.traffic.picture import Entry, Intent, TrafficPicture
from navigation_core.traffic.right_of_way import Claimant, Rank
from navigation_core.traffic.volumes import Volume, densified

__all__ = ["OtherTraffic", "Seen", "adsb_of", "seen_by_adsb"]

# Forgotten after so long without a report, and expected to go straight on for so long.
_FORGOTTEN_S, _AHEAD_S = 30.0, 20.0
# By how much it may turn or change its height meanwhile.
_TURNS_M_S2, _CLIMBS_M_S = 0.5, 1.0
# Uncertainties of a report without any, and of a pressure altitude beside one above sea level.
_ADSB_ERROR_M, _ADSB_RISE_M, _PRESSURE_RISE_M = 30.0, 30.0, 150.0
_NEEDED = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE
_VELOCITY = mavlink.ADSB_FLAGS_VALID_HEADING | mavlink.ADSB_FLAGS_VALID_VELOCITY


@dataclass(frozen=True)
class Seen:
    """One report of another vehicle.

    Attributes:
        name: identifies it.
        place: where it is.
        velocity_enu_m_s: how it moves.
        error_m: by how much the position may be wrong.
        rise_m: the same for the altitude.
    """

    name: str
    place: Geodetic
    velocity_enu_m_s: tuple[float, float, float]
    error_m: float
    rise_m: float

    @property
    def is_sound(self) -> bool:
        """Whether all numbers are finite and possible."""
        numbers = (*self.place, *self.velocity_enu_m_s, self.error_m, self.rise_m)
        return (
            all(map(math.isfinite, numbers))
            and abs(self.place[0]) <= 90.0
            and abs(self.place[1]) <= 180.0
            and min(self.error_m, self.rise_m) >= 0.0
        )


class OtherTraffic:
    """Keeps what is seen in the picture, ahead of where it was seen last, and less certain."""

    def __init__(self, picture: TrafficPicture) -> None:
        """Begin with nobody."""
        self._picture = picture
        self._seen: dict[str, tuple[Seen, tuple[float, float, float], float]] = {}

    def take(self, seen: Seen, place_m: tuple[float, float, float], now: float) -> None:
        """Take a report; its position is also given in the traffic frame."""
        self._seen[seen.name] = (seen, place_m, now)
        self._place(seen, place_m, 0.0, now)

    def look(self, now: float) -> None:
        """Move all on, and forget those that were not seen for long."""
        for name, (seen, place_m, seen_s) in list(self._seen.items()):
            if now - seen_s > _FORGOTTEN_S:
                del self._seen[name]
                self._picture.forget(name)
            else:
                self._place(seen, place_m, now - seen_s, now)

    def _place(
        self, seen: Seen, place_m: tuple[float, float, float], age_s: float, now: float
    ) -> None:
        velocity = np.array(seen.velocity_enu_m_s)
        start = np.array(place_m) + velocity * age_s
        entry: Entry = self._picture.entry(seen.name)
        entry.rank = Rank(Claimant.FIRMWARE, 0.0, seen.name)
        radius_m = seen.error_m + 0.5 * _TURNS_M_S2 * age_s * age_s
        rise_m = seen.rise_m + _CLIMBS_M_S * age_s
        entry.held = Volume.along(start[None], radius_m, rise_m)
        entry.moves, entry.heard_s = bool(np.linalg.norm(velocity) > 0.5), now
        entry.intruder = None
        if not entry.moves:
            entry.intent = None
            return
        entry.intruder = Intruder(
            np.array(place_m), velocity, now - age_s, seen.error_m, seen.rise_m
        )
        ends = np.array([start, start + velocity * _AHEAD_S])
        line, after_s = densified(ends, np.array([0.0, _AHEAD_S]))
        aside = 0.5 * _TURNS_M_S2 * (age_s + after_s) ** 2
        rises_m = seen.rise_m + _CLIMBS_M_S * (age_s + after_s)
        path = Volume.along(line, seen.error_m + aside, rises_m)
        entry.intent = Intent(path, now + after_s)


def seen_by_adsb(message: Any) -> Seen | None:
    """Return what an ADSB_VEHICLE says; None without a position or an altitude."""
    if message.flags & _NEEDED != _NEEDED:
        return None
    east_m_s = north_m_s = 0.0
    if message.flags & _VELOCITY == _VELOCITY:
        heading = math.radians(0.01 * message.heading)
        speed_m_s = 0.01 * message.hor_velocity
        east_m_s, north_m_s = speed_m_s * math.sin(heading), speed_m_s * math.cos(heading)
    up_m_s = 0.01 * message.ver_velocity
    pressure = message.altitude_type == mavlink.ADSB_ALTITUDE_TYPE_PRESSURE_QNH
    seen = Seen(
        f"ICAO {message.ICAO_address:06X}",
        (1e-7 * message.lat, 1e-7 * message.lon, 1e-3 * message.altitude),
        (east_m_s, north_m_s, up_m_s),
        _ADSB_ERROR_M + message.tslc * math.hypot(east_m_s, north_m_s),
        _PRESSURE_RISE_M if pressure else _ADSB_RISE_M,
    )
    return seen if seen.is_sound else None


def adsb_of(entry: Entry, place: Geodetic) -> Message:
    """Return an ADSB_VEHICLE that announces another vehicle, which is at a place."""
    address = sum(ord(letter) * 31**index for index, letter in enumerate(entry.name)) % 0xFFFFFF
    flags = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    return make(
        "ADSB_VEHICLE",
        ICAO_address=address,
        lat=round(place[0] * 1e7),
        lon=round(place[1] * 1e7),
        altitude_type=mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
        altitude=round(place[2] * 1e3),
        heading=0,
        hor_velocity=0,
        ver_velocity=0,
        callsign=entry.name[:8].encode("ascii", "replace"),
        emitter_type=mavlink.ADSB_EMITTER_TYPE_UAV,
        tslc=0,
        flags=flags | mavlink.ADSB_FLAGS_VALID_CALLSIGN,
        squawk=0,
    )
