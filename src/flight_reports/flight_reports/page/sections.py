"""Text sections of a report: flight summary, goals, tracking, warnings. Pure."""

from __future__ import annotations

from datetime import datetime, timezone

import numpy as np

from flight_reports.analysis.flight import Flight
from flight_reports.analysis.tracking import Tracking
from flight_reports.analysis.warnings import Warned, lacking, reason, warnings
from flight_reports.page.html import Markup, at, duration, element, joined, number, safe, table
from flight_reports.recorded_events import EventSeverity, named
from navigation_bridge.recording.recorded_notes import RecordedGoal

_TIMES_MAX = 6
_SIGNS = {
    EventSeverity.BAD: "▲ error",
    EventSeverity.WARNING: "● warning",
    EventSeverity.INFO: "note",
}


def summary(flight: Flight) -> Markup:
    """Return the summary of the flight."""
    retold, contents = flight.retold, flight.contents
    begun = datetime.fromtimestamp(contents.begun_unix_s, timezone.utc)
    facts = [
        ("vehicle", retold.name or "unknown"),
        ("firmware", retold.state.firmware_version or "unknown"),
        ("recorded", f"{begun:%Y-%m-%d %H:%M:%S} UTC" if contents.has_date else "unknown"),
        ("duration", duration(flight.contents.duration_s)),
        ("armed", duration(flight.armed_s) if retold.armed else "unknown"),
    ]
    figures = flight.figures
    if figures is not None:
        facts += [
            ("distance", number(figures.distance_m, "m", 0)),
            ("highest", f"{number(figures.highest_m, 'm')} above {figures.height_reference}"),
        ]
        if figures.fastest_m_s is not None:
            facts.append(("fastest", number(figures.fastest_m_s, "m/s")))
    if retold.battery:
        facts.append(("battery", _battery([percent for _, percent in retold.battery])))
    if noted := retold.noted.goals:
        done = sum(goal.code == "SUCCESS" for goal in noted)
        facts += [("goals", f"{done} of {len(noted)} reached"), ("replans", str(replans(flight)))]
    link = flight.link
    facts.append(("packets lost", f"{link.loss_share:.1%}" if link.numbers_follow else "unknown"))
    return element(
        "dl",
        *(element("div", element("dt", k), element("dd", v)) for k, v in facts),
        class_="facts",
    )


def _battery(percent: list[float]) -> str:
    first, last, least = percent[0], percent[-1], min(percent)
    return f"{first:.0f} → {last:.0f} %" + (f", min {least:.0f} %" if least < last - 1.0 else "")


def replans(flight: Flight) -> int:
    """Return the number of replans of all goals."""
    counts = [count for _, count in flight.retold.noted.replans]
    return int(
        sum(max(after - before, 0) for before, after in zip([0, *counts], counts, strict=False))
    )


def not_in_the_log(flight: Flight) -> Markup:
    """Return the list of missing content."""
    rows = lacking(flight)
    if not rows:
        return Markup()
    return element(
        "div",
        element("h3", "Not in this log"),
        element("ul", *(element("li", sentence) for sentence in rows)),
        class_="lacking",
    )


def goals(flight: Flight, section: str) -> Markup:
    """Return the goals with times, errors and reasons; nothing without goals."""
    noted = flight.retold.noted.goals
    if not noted:
        return Markup()
    heads = ("no.", "goal", "accepted", "target (m: east, north, up)", "progress", "end",
             "duration", "error", "replans", "server message")  # fmt: skip
    rows = [_goal(flight, goal, place, section) for place, goal in enumerate(noted)]
    return joined((element("h3", "Goals"), table(heads, rows, "goals")))


def _goal(flight: Flight, goal: RecordedGoal, place: int, section: str) -> list[object]:
    targets = [", ".join(f"{part:.1f}" for part in target) for target in goal.targets_enu_m]
    aims = joined(element("div", f"({target})") for target in targets) if targets else "–"
    did = joined(
        element("div", at(time_s, section), f" {status}", f": {why}" if why else "")
        for time_s, status, why in goal.statuses
    )
    took_s = goal.elapsed_s
    if took_s is None and goal.ended_s is not None:
        took_s = goal.ended_s - goal.accepted_s
    end = element("span", goal.code or "not in the log", class_=_end_class(goal.code))
    if goal.ended_s is not None:
        end = joined((end, element("div", at(goal.ended_s, section))))
    about = joined((element("b", goal.kind), element("div", goal.short_id, class_="id")))
    error = number(goal.final_error_m, "m", 2)
    if goal.final_error_m is None and (measured := _error_m(flight, goal)) is not None:
        error = f"≈ {measured:.2f} m"
    words = joined(
        element("div", part) for part in (goal.description, reason(goal.message, goal.code)) if part
    )
    return [place + 1, about, at(goal.accepted_s, section), aims, did, end, number(took_s, "s"),
            error, goal.replans, words or "–"]  # fmt: skip


def _end_class(code: str) -> str:
    return (
        "good" if code == "SUCCESS" else "calm" if code in ("", "PREEMPTED", "CANCELED") else "bad"
    )


def _error_m(flight: Flight, goal: RecordedGoal) -> float | None:
    """Return how far the vehicle was from the last target when a goal was reached."""
    here = None if goal.ended_s is None else flight.track.at(goal.ended_s)
    if here is None or goal.code != "SUCCESS" or not goal.targets_enu_m:
        return None
    return float(np.linalg.norm(np.subtract(here, goal.targets_enu_m[-1])))


def tracking(flight: Flight) -> Markup:
    """Return the tracking table; nothing without setpoints."""
    rows = [
        _tracking_row(name, compared)
        for name, compared in (
            ("positions", flight.position_tracking),
            ("velocities", flight.velocity_tracking),
        )
        if compared is not None
    ]
    if not rows:
        return Markup()
    heads = ("setpoints of", "horizontal, RMS", "horizontal, max", "vertical, RMS", "vertical, max",
             "delay", "compared", "excluded")  # fmt: skip
    note = (
        "SET_POSITION_TARGET against the LOCAL_POSITION_NED of the same time. Excluded are "
        "setpoints that the vehicle had not reached yet. Delay: the time shift with the "
        "smallest difference between setpoint and response."
    )
    return joined((element("h3", "Setpoint tracking"), table(heads, rows, "figures"),
                   element("p", note, class_="note")))  # fmt: skip


def _tracking_row(name: str, rows: Tracking) -> list[object]:
    figures = (rows.horizontal_rms, rows.horizontal_max, rows.vertical_rms, rows.vertical_max)
    delay = "–" if rows.delay_s is None else number(rows.delay_s, "s", 2)
    return [name, *(number(value, rows.unit, 2) for value in figures), delay, rows.count,
            rows.left_out]  # fmt: skip


def worth_a_look(flight: Flight, section: str) -> Markup:
    """Return the warnings with their times."""
    found = warnings(flight)
    head = element("h3", "Warnings")
    if not found:
        return joined((head, element("p", "None: no failsafe, no gap, no unanswered command.")))
    rows = [_warning_row(warned, section) for warned in found]
    return joined((head, table(("when", "severity", "about", "what"), rows, "warnings")))


def _warning_row(warned: Warned, section: str) -> list[object]:
    severity = warned.first.severity
    times = joined(element("div", at(t_s, section)) for t_s in warned.times_s[:_TIMES_MAX])
    more = len(warned.times_s) - _TIMES_MAX
    if more > 0:
        times = joined((times, element("div", f"and {more} more times")))
    sign = element("span", _SIGNS[severity], class_=f"sign {severity.value}")
    return [times, sign, warned.first.kind, warned.first.text]


def speakers(flight: Flight) -> Markup:
    """Return the senders and their link quality."""
    heads = ("system/component", "what", "packets", "lost", "repeated", "commands", "setpoints")
    rows = []
    for speaker in flight.speakers:
        link = speaker.link
        lost = f"{link.lost} ({link.loss_share:.1%})" if link.numbers_follow else "unknown"
        if speaker.is_recorder:
            lost = "–"
        what = speaker.what + (" (this vehicle)" if speaker.source == flight.source else "")
        rows.append([named(speaker.source), what, link.received, lost, link.repeated,
                     speaker.requests, speaker.setpoints])  # fmt: skip
    return joined((element("h3", "Senders"), table(heads, rows, "figures named")))


def messages(flight: Flight) -> Markup:
    """Return the rates of the vehicle's messages."""
    rates = {name: rate for (who, name), rate in flight.contents.rates.items()
             if who == flight.source}  # fmt: skip
    heads = ("message", "count", "per second", "longest gap")
    rows = [
        [name, rate.count, number(rate.rate_hz), number(rate.longest_gap_s, "s")]
        for name, rate in sorted(rates.items())
    ]
    title = element("summary", f"Messages of the vehicle ({len(rows)} kinds)")
    return element("details", title, table(heads, rows, "figures few"))


def modes(flight: Flight, section: str) -> Markup:
    """Return the modes with the time each began."""
    rows = [
        element("li", at(time_s, section), " ", safe(name)) for time_s, name in flight.retold.modes
    ]
    if not rows:
        return Markup()
    return element("details", element("summary", f"Modes ({len(rows)})"), element("ol", *rows))
