"""The report of a recorded flight as values, for programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.analysis.tracking import Tracking
from flight_reports.analysis.warnings import Warned, lacking, warnings
from flight_reports.contents.log_reader import read_log
from flight_reports.page.comparison import energy_wh
from flight_reports.page.sections import replans
from navigation_bridge.recording.recorded_notes import RecordedGoal

__all__ = ["flight_values", "report_values"]

_NEWEST = 20


def report_values(log: Path) -> list[Mapping[str, object]]:
    """Read a log; return what its report shows of each vehicle, for JSON.

    Raises:
        LogError: it cannot be read, or is no log.
    """
    return [flight_values(flight) for flight in read_flights(read_log(log))]


def flight_values(flight: Flight) -> Mapping[str, object]:
    """Return the figures of a flight, with units in their names; None for what is not known.

    Times are seconds since the log's first packet. Of goals and warnings the newest are there.
    """
    figures, link, retold = flight.figures, flight.link, flight.retold
    battery = [percent for _, percent in retold.battery]
    return {
        "vehicle": flight.name,
        "firmware": retold.state.firmware_version or None,
        "duration_s": flight.contents.duration_s,
        "armed_s": flight.armed_s if retold.armed else None,
        "distance_m": figures.distance_m if figures else None,
        "highest_m": figures.highest_m if figures else None,
        "highest_above": figures.height_reference if figures else None,
        "fastest_m_s": figures.fastest_m_s if figures else None,
        "battery_first_percent": battery[0] if battery else None,
        "battery_last_percent": battery[-1] if battery else None,
        "energy_wh": energy_wh(flight),
        "packets_lost_percent": 100.0 * link.loss_share if link.numbers_follow else None,
        "replans": replans(flight),
        "position_tracking": _tracking(flight.position_tracking),
        "goals": [_goal(goal) for goal in retold.noted.goals[-_NEWEST:]],
        "warnings": [_warning(warned) for warned in warnings(flight)[-_NEWEST:]],
        "lacks": lacking(flight),
    }


def _tracking(found: Tracking | None) -> Mapping[str, object] | None:
    if found is None:
        return None
    return {
        "horizontal_rms_m": found.horizontal_rms,
        "horizontal_max_m": found.horizontal_max,
        "vertical_rms_m": found.vertical_rms,
        "vertical_max_m": found.vertical_max,
        "delay_s": found.delay_s,
    }


def _goal(goal: RecordedGoal) -> Mapping[str, object]:
    return {
        "id": goal.goal_id,
        "action": goal.kind,
        "description": goal.description,
        "targets_enu_m": goal.targets_enu_m,
        "accepted_s": goal.accepted_s,
        "ended_s": goal.ended_s,
        "code": goal.code or None,
        "message": goal.message,
        "final_error_m": goal.final_error_m,
        "replans": goal.replans,
    }


def _warning(warned: Warned) -> Mapping[str, object]:
    first = warned.first
    return {
        "first_s": first.time_s,
        "times": len(warned.times_s),
        "severity": first.severity.value,
        "about": first.kind,
        "text": first.text,
    }
