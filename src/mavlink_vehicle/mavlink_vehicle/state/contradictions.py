"""Judges whether reports from the vehicle's ids contradict each other. Pure.

A single frame does not show that somebody else has sent it with the vehicle's ids. But the vehicle
continues to report: the other report is taken back within the time between two of its kind, again
and again. A vehicle is not armed and disarmed by turns, nor does its home, its position or its
charge go to and fro.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, TypeAlias

from mavlink_vehicle.codec import mavlink
from mavlink_vehicle.events import LandedState
from mavlink_vehicle.state.vehicle_state import VehicleState

_RETURNS, _WITHIN_S = 3, 16.0
"""How often a report must be taken back, and within which time.

A pilot who arms and disarms at once takes back one or two; a sender that speaks every 5 s is found
after 11 s, and for as long as it speaks."""

# Longest time between two reports: HEARTBEAT and GPS_RAW_INT 1 s, HOME_POSITION of a PX4 2 s.
_PERIOD_S, _HOME_PERIOD_S = 1.3, 2.5
# Less is noise: of a charge that is estimated from the voltage, of a place.
_SHARE_OFF, _OFF_M = 0.25, 2.0
_DEGREE_M = 111_200.0

_Value: TypeAlias = tuple[float, ...]


class _Fact(NamedTuple):
    """Something that the vehicle reports again and again.

    Attributes:
        words: what contradicts, as the end of a sentence.
        part: the attribute of the state that it is in.
        of: its value in a state; None while it is unknown.
        off: by how much two values differ at least.
        brief_s: for how long a value that is taken back stands at most.
    """

    words: str
    part: str
    of: Callable[[VehicleState], _Value | None]
    off: float
    brief_s: float = _PERIOD_S


def _armed(state: VehicleState) -> _Value | None:
    return None if state.last_heartbeat_s is None else (float(state.armed_heard),)


def _on_ground(state: VehicleState) -> _Value | None:
    if state.landed_state is LandedState.UNDEFINED:
        return None
    return (float(state.landed_state is LandedState.ON_GROUND),)


def _fixed(state: VehicleState) -> _Value | None:
    gps = state.gps
    return None if gps is None else (float(gps.fix_type >= mavlink.GPS_FIX_TYPE_3D_FIX),)


def _charge(state: VehicleState) -> _Value | None:
    summary = state.battery_summary
    return None if summary is None or summary.remaining is None else (summary.remaining,)


def _first_charge(state: VehicleState) -> _Value | None:
    first = state.batteries[0] if state.batteries else None
    return None if first is None or first.remaining is None else (first.remaining,)


def _home_m(state: VehicleState) -> _Value | None:
    home = state.home
    if home is None:
        return None
    shrunk_m = _DEGREE_M * math.cos(math.radians(home.latitude_deg))
    return (_DEGREE_M * home.latitude_deg, shrunk_m * home.longitude_deg, home.altitude_amsl_m)


_FACTS = (
    _Fact("armed and disarmed", "armed_heard", _armed, 0.5),
    _Fact("on the ground and in the air", "landed_state", _on_ground, 0.5),
    _Fact("with a GPS fix and without one", "gps", _fixed, 0.5),
    _Fact("with two charges of its battery", "battery_summary", _charge, _SHARE_OFF),
    _Fact("with two charges of its battery", "batteries", _first_charge, _SHARE_OFF),
    _Fact("with two homes", "home", _home_m, _OFF_M, _HOME_PERIOD_S),
)
_POSITION = _Fact("at two positions", "", lambda _: None, _OFF_M)


@dataclass
class _Course:
    """The values of a fact: the last one, the one before, and when values were taken back."""

    value: _Value | None = None
    since_s: float = -math.inf
    before: _Value | None = None
    returns_s: deque[float] = field(default_factory=lambda: deque(maxlen=_RETURNS))

    def take(self, fact: _Fact, value: _Value, now: float) -> None:
        """Continue with a value."""
        if self.value is not None and _differ(fact, value, self.value):
            is_brief = now - self.since_s <= fact.brief_s
            if is_brief and self.before is not None and not _differ(fact, value, self.before):
                self.returns_s.append(now)
            self.before, self.since_s = self.value, now
        self.value = value

    def contradicts(self, now: float) -> bool:
        """Whether values were taken back too often of late."""
        returns_s = self.returns_s
        return len(returns_s) == _RETURNS and now - returns_s[0] <= _WITHIN_S


class Contradictions:
    """Follows what one vehicle reports.

    Attributes:
        reason: what contradicts itself, as part of a sentence; empty for nothing.
    """

    def __init__(self) -> None:
        """Begin without reports."""
        self.reason = ""
        self._courses: dict[_Fact, _Course] = {}

    def observe(self, before: VehicleState, state: VehicleState, now: float) -> None:
        """Process what a message has changed.

        Args:
            before: the state before it.
            state: the state after it.
            now: time in seconds.
        """
        if state.boot_count != before.boot_count:
            self._courses.clear()
        for fact in _FACTS:
            if getattr(state, fact.part) is getattr(before, fact.part):
                continue
            if (value := fact.of(state)) is not None:
                self._courses.setdefault(fact, _Course()).take(fact, value, now)
        self._judge(now)

    def jumped(self, jumps_ned_m: Sequence[float], now: float) -> None:
        """Process a jump of the position.

        Args:
            jumps_ned_m: north and east of all jumps, added up.
            now: time in seconds.
        """
        course = self._courses.setdefault(_POSITION, _Course((0.0, 0.0)))
        course.take(_POSITION, tuple(jumps_ned_m), now)
        self._judge(now)

    def _judge(self, now: float) -> None:
        found = (f.words for f, course in self._courses.items() if course.contradicts(now))
        words = next(found, "")
        self.reason = f"its reports contradict each other, {words} by turns" if words else ""


def _differ(fact: _Fact, value: _Value, other: _Value) -> bool:
    return math.dist(value, other) >= fact.off
