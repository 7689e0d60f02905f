"""Possible causes of a failed goal: setpoint gaps, a late loop, low clearance. Pure."""

from __future__ import annotations

import itertools

import numpy as np

from flight_logs.vehicles import Source
from flight_reports.analysis.flight import Flight
from flight_reports.contents.log_reader import SETPOINTS, Floats
from flight_reports.recorded_events import EventSeverity, Moment
from flight_reports.timeline import Timeline
from navigation_bridge.configuration.settings import ObstacleConfig
from navigation_bridge.recording.recorded_notes import RecordedGoal
from navigation_core.tasks.progress import Status

# A setpoint is late after this, or this many of the usual periods. A PX4 leaves OFFBOARD after
# one second without (COM_OF_LOSS_T), an ArduPilot flies on at its last velocity for three.
_GAP_S, _GAP_PERIODS = 0.5, 5.0
_GAP_BAD_S = 1.0
# A loop that stood still read nothing for this share of a gap, and within this time afterwards it
# reads this many times the usual number of packets.
_STILL_SHARE = 0.7
_BURST_S = 0.2
_BURST_FACTOR = 2.0
_FLYING = frozenset({Status.NAVIGATING.value, Status.SETTLING.value, Status.BLOCKED.value})
# The log doesn't have the server's settings; these are their defaults. Nearer than its radius, the
# vehicle touches an obstacle; it plans to keep a margin of twice this half.
_TOUCHES_M = ObstacleConfig().vehicle_radius_m
_CLOSE_M = _TOUCHES_M + 0.5 * ObstacleConfig().margin_m
BEFORE_S = 5.0
"""Time before a failed goal in which possible causes are searched."""


def causes(flight: Flight, server: Source | None) -> list[Moment]:
    """Return possible causes of a failed goal.

    Args:
        flight: of one vehicle.
        server: who sent the setpoints; None if nobody did.
    """
    setpoints_s = _setpoints_s(flight, server)
    moments = []
    for goal in flight.retold.noted.goals:
        moments += _late(flight, goal, setpoints_s) + _near(flight, goal)
    return moments


def shortly_before(moment_s: float, moments: list[Moment]) -> str:
    """Return a sentence about problems shortly before a moment; empty without any."""
    texts = [
        f"{moment_s - moment.time_s:.1f} s before: {moment.text}"
        for moment in sorted(moments, key=lambda moment: moment.time_s)
        if moment.severity is EventSeverity.BAD and 0.0 <= moment_s - moment.time_s <= BEFORE_S
    ]
    return "; ".join(dict.fromkeys(texts))


def _setpoints_s(flight: Flight, server: Source | None) -> Floats:
    """Return the times of setpoints to the vehicle, in order."""
    times = [np.zeros(0)]
    for name in SETPOINTS:
        records = None if server is None else flight.contents.of(name, server)
        if records is not None:
            times.append(records["time_s"][records["target_system"] == flight.source[0]])
    return np.sort(np.concatenate(times))


def _late(flight: Flight, goal: RecordedGoal, setpoints_s: Floats) -> list[Moment]:
    """Return the gaps between setpoints while a goal was flown, the worst of them in the text."""
    if len(setpoints_s) < 2:
        return []
    limit_s = max(_GAP_S, _GAP_PERIODS * float(np.median(np.diff(setpoints_s))))
    gaps: dict[bool, list[tuple[float, float]]] = {}
    for begin_s, next_s in itertools.pairwise([*setpoints_s.tolist(), np.inf]):
        if next_s - begin_s <= limit_s:
            continue
        end_s = min(next_s, _flown_until_s(flight, goal, begin_s))
        if end_s - begin_s > limit_s:
            gaps.setdefault(_stood_still(flight, begin_s, end_s), []).append((begin_s, end_s))
    moments = []
    for still, spans in sorted(gaps.items()):
        longest_s = max(end_s - begin_s for begin_s, end_s in spans)
        severity = EventSeverity.BAD if longest_s >= _GAP_BAD_S else EventSeverity.WARNING
        until = f"for {'up to ' if len(spans) > 1 else ''}{longest_s:.1f} s"
        text = f"Goal {goal.short_id} received no setpoint {until}"
        if still:
            text += ": the server loop was late and read nothing either"
        kind = "late loop" if still else "setpoints"
        moments += [Moment(begin_s, kind, text, severity) for begin_s, _ in spans]
    return moments


def _flown_until_s(flight: Flight, goal: RecordedGoal, begin_s: float) -> float:
    """Return until when a goal was flown by setpoints from a time on, as far as the log shows."""
    ended_s = flight.contents.duration_s if goal.ended_s is None else goal.ended_s
    if not goal.accepted_s <= begin_s <= ended_s:
        return begin_s
    flying = [(time_s, status in _FLYING) for time_s, status, _ in goal.statuses]
    ends_s = [ended_s]
    for moments in (flying, flight.retold.led):
        if not Timeline.of(moments).at(begin_s):
            return begin_s
        ends_s += [time_s for time_s, goes_on in moments if time_s > begin_s and not goes_on]
    return min(ends_s)


def _stood_still(flight: Flight, begin_s: float, end_s: float) -> bool:
    """Return whether the recorder read nothing in a gap and much right after it."""
    packets = flight.contents.packets
    own = (packets["system"] == flight.source[0]) & (packets["component"] == flight.source[1])
    time_s: Floats = packets["time_s"][own]
    first, last = np.searchsorted(time_s, [begin_s, end_s])
    silence_s = float(np.diff(np.concatenate([[begin_s], time_s[first:last], [end_s]])).max())
    if silence_s < _STILL_SHARE * (end_s - begin_s):
        return False
    usual = len(time_s) / max(flight.contents.duration_s, _BURST_S)
    after = np.searchsorted(time_s, end_s + _BURST_S) - np.searchsorted(time_s, end_s - _BURST_S)
    return bool(after >= _BURST_FACTOR * usual * _BURST_S)


def _near(flight: Flight, goal: RecordedGoal) -> list[Moment]:
    """Return the moment of the least clearance, if it was too low."""
    near = flight.clearance
    ended_s = flight.contents.duration_s if goal.ended_s is None else goal.ended_s
    during = np.flatnonzero((near.time_s >= goal.accepted_s) & (near.time_s <= ended_s))
    if not len(during):
        return []
    place = int(during[np.argmin(near.distance_m[during])])
    nearest_m = float(near.distance_m[place])
    if nearest_m >= _CLOSE_M:
        return []
    severity = EventSeverity.BAD if nearest_m < _TOUCHES_M else EventSeverity.WARNING
    text = f"An obstacle was {nearest_m:.2f} m from the range sensor"
    return [Moment(float(near.time_s[place]), "clearance", text, severity)]
