"""Other traffic, as ADS-B receivers and other sources report it. No ROS."""

from __future__ import annotations

import itertools
import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mavlink_vehicle.codec import Message, make, mavlink
from mavlink_vehicle.positions.frames import Geodetic
from navigation_bridge.traffic.own_echo import EchoWatch, OwnTrack
from navigation_core.tasks.traffic.entries import Claimant, Entry, Intent, Rank
from navigation_core.tasks.traffic.intruders import (
    CLIMBS_M_S,
    STRAIGHT,
    TURNS_M_S2,
    Intruder,
    Turn,
    TurnWatch,
)
from navigation_core.tasks.traffic.reservations import TrafficReservations
from navigation_core.tasks.traffic.volumes import Array, Volume, densified, joined

__all__ = ["OtherTraffic", "Seen", "address_of", "adsb_of", "is_by_adsb", "seen_by_adsb"]

# A target is forgotten after this time without a report.
_REPORT_AGE_MAX_S = 30.0
# The times from now on for which the motion of a target is predicted.
_PREDICTED_AFTER_S: Array = np.linspace(0.0, 20.0, 11)
# Errors of a report that has none, and of a pressure altitude as an altitude above sea level.
_ADSB_ERROR_M, _ADSB_RISE_M, _PRESSURE_RISE_M = 30.0, 30.0, 150.0
_POSITION_FLAGS = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE
_HORIZONTAL_FLAGS = mavlink.ADSB_FLAGS_VALID_HEADING | mavlink.ADSB_FLAGS_VALID_VELOCITY
_VERTICAL_FLAGS = mavlink.ADSB_FLAGS_VALID_VELOCITY | mavlink.ADSB_FLAGS_VERTICAL_VELOCITY_VALID
# No aircraft is faster or higher.
_SPEED_MAX_M_S, _ALTITUDE_MAX_M = 600.0, 30e3
_ICAO, _ANONYMOUS = "ICAO ", "ADSB "
# Maximum number of targets; the one without a report for the longest time is forgotten first.
_TARGETS_MAX = 2000
# A target that is farther away than it flies in this time, plus this distance, does not matter yet.
_FAR_S, _FAR_M = 40.0, 500.0
# A velocity that is not reported is derived from positions that are this far apart in time.
_BASE_MIN_S, _BASE_MAX_S = 0.8, 5.0
# A report without an address belongs to a known target if it is within this distance of where that
# is predicted, and the same source has not just reported that target.
_SAME_M, _SAME_RISE_M, _SAME_M_S2, _JUST_NOW_S = 40.0, 60.0, 3.0, 0.4


@dataclass(frozen=True)
class Seen:
    """One report of another vehicle.

    Attributes:
        name: identifies it; without an address its call sign, which others may share.
        place: its position.
        velocity_enu_m_s: its velocity; NaN where that is not reported.
        error_m: error of the position, horizontal.
        rise_m: error of the altitude.
        age_s: age of the report.
        address: its ICAO address; 0 without one, None if it is not seen by ADS-B.
    """

    name: str
    place: Geodetic
    velocity_enu_m_s: tuple[float, float, float]
    error_m: float
    rise_m: float
    age_s: float = 0.0
    address: int | None = None

    @property
    def is_sound(self) -> bool:
        """Whether all numbers are possible."""
        numbers = (*self.place, self.error_m, self.rise_m, self.age_s)
        return (
            all(map(math.isfinite, numbers))
            and abs(self.place[0]) <= 90.0
            and abs(self.place[1]) <= 180.0
            and abs(self.place[2]) <= _ALTITUDE_MAX_M
            and min(self.error_m, self.rise_m, self.age_s) >= 0.0
            and self.age_s < _REPORT_AGE_MAX_S
            and not any(abs(speed) > _SPEED_MAX_M_S for speed in self.velocity_enu_m_s)
        )


@dataclass
class _Target:
    """State of one target.

    Attributes:
        seen: the last report.
        position_m: its position in that report, traffic frame, shape (3,).
        velocity_m_s: its velocity then, shape (3,).
        time_s: time of that position.
        heard_s: time at which the report arrived.
        by: time of the last report of each source.
        before: earlier times and positions.
        turn: its turn rate, and for how long it was seen.
        turns: derives the turn from courses.
        echoes: for each own vehicle, whether the target is that vehicle's echo.
    """

    seen: Seen
    position_m: Array
    velocity_m_s: Array
    time_s: float
    heard_s: float
    by: dict[str, float] = field(default_factory=dict)
    before: deque[tuple[float, Array]] = field(default_factory=deque)
    turn: Turn = STRAIGHT
    turns: TurnWatch = field(default_factory=TurnWatch)
    echoes: dict[str, EchoWatch] = field(default_factory=dict)

    @property
    def is_echo(self) -> bool:
        """Whether it is the echo of an own vehicle."""
        return any(watch.is_echo for watch in self.echoes.values())


class OtherTraffic:
    """Keeps the reported targets among the reservations, with predicted positions and errors.

    Attributes:
        own: recent positions of the own vehicles, by name.
        own_addresses: ICAO addresses of the own vehicles: those that they announce, and those with
            which the server announces them.
    """

    def __init__(self, reservations: TrafficReservations) -> None:
        """Begin without targets."""
        self._reservations = reservations
        self._targets: dict[str, _Target] = {}
        self._numbers = itertools.count(1)
        self.own: dict[str, OwnTrack] = {}
        self.own_addresses: set[int] = set()

    def take(
        self, seen: Seen, place_m: tuple[float, float, float], now: float, source: str = ""
    ) -> None:
        """Take a report; its position is also given in the traffic frame.

        Args:
            seen: the report.
            place_m: its position.
            now: time in seconds.
            source: who reported it.
        """
        if not seen.is_sound or seen.address in self.own_addresses:
            return
        position, time_s = np.array(place_m), now - seen.age_s
        name = seen.name if seen.address != 0 else self._name_of(seen, position, time_s, source)
        target = self._targets.pop(name, None)
        if target is None:
            target = _Target(seen, position, np.zeros(3), time_s, now)
        elif time_s < target.time_s - 0.05:
            self._targets[name] = target
            return  # another source has a later one
        target.seen, target.position_m, target.time_s, target.heard_s = seen, position, time_s, now
        target.by[source] = now
        self._move(target)
        self._targets[name] = target  # the last in the order of hearing
        reported = None if math.isnan(seen.velocity_enu_m_s[0]) else target.velocity_m_s
        for own_name, own in self.own.items():
            watch = target.echoes.setdefault(own_name, EchoWatch())
            watch.watch(own, position, reported, time_s)
        while len(self._targets) > _TARGETS_MAX:
            self._forget(next(iter(self._targets)))
        if name in self._targets:
            self._show(name, target, now)

    def look(self, now: float) -> None:
        """Predict all targets for now, and forget those without a recent report."""
        for name, target in list(self._targets.items()):
            if now - target.time_s > _REPORT_AGE_MAX_S:
                self._forget(name)
            else:
                self._show(name, target, now)

    def _forget(self, name: str) -> None:
        del self._targets[name]
        self._reservations.forget(name)

    def _name_of(self, seen: Seen, position_m: Array, time_s: float, source: str) -> str:
        """Return the name of the target that a report without an address is about, or a new one.

        Of the targets with the same call sign, it is the one whose predicted position is nearest. A
        target that this source has just reported is excluded: it reports each once a second.
        """
        best, least = "", 1.0
        for name, target in self._targets.items():
            if target.seen.address != 0 or target.seen.name != seen.name:
                continue
            after_s = max(time_s - target.time_s, 0.0)
            if time_s + seen.age_s - target.by.get(source, -math.inf) < _JUST_NOW_S:
                continue
            gap = position_m - target.position_m - target.velocity_m_s * after_s
            room_m = _SAME_M + 0.5 * _SAME_M_S2 * after_s * after_s
            share = max(math.hypot(gap[0], gap[1]) / room_m, abs(gap[2]) / _SAME_RISE_M)
            if share < least:
                best, least = name, share
        return best or f"{seen.name} {next(self._numbers)}"

    @staticmethod
    def _move(target: _Target) -> None:
        """Take the reported velocity; components not reported are derived from positions."""
        while target.before and target.time_s - target.before[0][0] > _BASE_MAX_S:
            target.before.popleft()
        velocity = np.array(target.seen.velocity_enu_m_s)
        unknown = np.isnan(velocity)
        derived = np.zeros(3)
        if target.before and target.time_s - target.before[0][0] >= _BASE_MIN_S:
            since_s, position = target.before[0]
            derived = (target.position_m - position) / (target.time_s - since_s)
            derived = np.clip(derived, -_SPEED_MAX_M_S, _SPEED_MAX_M_S)
        target.before.append((target.time_s, target.position_m))
        target.velocity_m_s = np.where(unknown, derived, velocity)
        target.turn = target.turns.watch(target.velocity_m_s, target.time_s)

    def _show(self, name: str, target: _Target, now: float) -> None:
        """Put a target among the reservations, or remove it if it cannot matter."""
        if target.is_echo or self._is_far(target):
            self._reservations.forget(name)
        else:
            self._place(name, target, now)

    def _is_far(self, target: _Target) -> bool:
        reach_m = _FAR_M + _FAR_S * float(np.linalg.norm(target.velocity_m_s))
        places = [one for one in (own.position_m for own in self.own.values()) if one is not None]
        return bool(places) and all(
            math.dist(place, target.position_m) > reach_m for place in places
        )

    def _place(self, name: str, target: _Target, now: float) -> None:
        seen, velocity, age_s = target.seen, target.velocity_m_s, now - target.time_s
        intruder = Intruder(
            target.position_m, velocity, target.time_s, seen.error_m, seen.rise_m, target.turn
        )
        entry: Entry = self._reservations.entry(name)
        entry.rank = Rank(Claimant.FIRMWARE, 0.0, name)
        radius_m = seen.error_m + 0.5 * TURNS_M_S2 * age_s * age_s
        rise_m = seen.rise_m + CLIMBS_M_S * age_s
        entry.held = Volume.along(intruder.paths(np.array([age_s]))[:, 0], radius_m, rise_m)
        entry.moves, entry.heard_s = bool(np.linalg.norm(velocity) > 0.5), now
        entry.intruder = intruder
        if not entry.moves:
            entry.intent = None
            return
        lines, arrivals_s = [], []
        for path in intruder.paths(age_s + _PREDICTED_AFTER_S):
            line, after_s = densified(path, _PREDICTED_AFTER_S)
            aside = 0.5 * TURNS_M_S2 * (age_s + after_s) ** 2
            rises_m = seen.rise_m + CLIMBS_M_S * (age_s + after_s)
            lines.append(Volume.along(line, seen.error_m + aside, rises_m))
            arrivals_s.append(now + after_s)
        entry.intent = Intent(joined(*lines), np.concatenate(arrivals_s))


def seen_by_adsb(message: Any) -> Seen | None:
    """Return the report in an ADSB_VEHICLE; None without a possible position and altitude.

    ADSB_FLAGS shows which fields are valid. The values that senders use for unknown speeds and
    headings are impossible ones, and are rejected as such.
    """
    if message.flags & _POSITION_FLAGS != _POSITION_FLAGS or (
        message.lat == 0 and message.lon == 0
    ):
        return None
    east_m_s = north_m_s = up_m_s = math.nan
    speed_m_s = 0.01 * message.hor_velocity
    possible = message.heading <= 36000 and speed_m_s <= _SPEED_MAX_M_S
    if message.flags & _HORIZONTAL_FLAGS == _HORIZONTAL_FLAGS and possible:
        heading = math.radians(0.01 * message.heading)
        east_m_s, north_m_s = speed_m_s * math.sin(heading), speed_m_s * math.cos(heading)
    if message.flags & _VERTICAL_FLAGS and abs(message.ver_velocity) < 2**15 - 1:
        up_m_s = 0.01 * message.ver_velocity
    pressure = message.altitude_type == mavlink.ADSB_ALTITUDE_TYPE_PRESSURE_QNH
    address = int(message.ICAO_address)
    callsign = "".join(filter(str.isalnum, message.callsign))[:8]
    seen = Seen(
        f"{_ICAO}{address:06X}" if address else f"{_ANONYMOUS}{callsign or 'anonymous'}",
        (1e-7 * message.lat, 1e-7 * message.lon, 1e-3 * message.altitude),
        (east_m_s, north_m_s, up_m_s),
        _ADSB_ERROR_M,
        _PRESSURE_RISE_M if pressure else _ADSB_RISE_M,
        float(message.tslc),
        address,
    )
    return seen if seen.is_sound else None


def is_by_adsb(name: str) -> bool:
    """Whether a name in the reservations is that of a target seen by ADS-B."""
    return name.startswith((_ICAO, _ANONYMOUS))


def address_of(name: str) -> int:
    """Return the address with which a vehicle is announced."""
    total = sum(ord(letter) * pow(31, index) for index, letter in enumerate(name))
    return int(total % 0xFFFFFE) + 1


def adsb_of(entry: Entry, place: Geodetic) -> Message:
    """Return an ADSB_VEHICLE that announces another vehicle, which is at a place."""
    flags = mavlink.ADSB_FLAGS_VALID_COORDS | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    return make(
        "ADSB_VEHICLE",
        ICAO_address=address_of(entry.name),
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
