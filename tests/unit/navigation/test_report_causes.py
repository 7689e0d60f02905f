"""A report names what made a flight end badly: a late loop, no setpoints, an obstacle, a crash."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from flight_reports.analysis.flight import Flight, read_flights
from flight_reports.analysis.warnings import Warned, warnings
from flight_reports.contents.log_reader import read_contents
from flight_reports.recorded_events import EventSeverity
from mavlink_vehicle.codec import Codec, Message, make, mavlink, with_source
from mavlink_vehicle.io.tlog import TlogWriter
from navigation_bridge import notes
from navigation_bridge.goals.goal import GoalHappened

GOAL_ID = "d000e038" + 24 * "a"
NOTES, SERVER, VEHICLE = (1, notes.COMPONENT_ID), (1, 191), (1, 1)
ARMED, DISARMED = 217, 89
CRASH = "Crash: hit scaffold at 0.9 m/s"
ACCEPTED_S, NAVIGATING_S, END_S = 1.0, 2.0, 12.0
# The server stands still for this long; it had much to read afterwards.
STILL_FROM_S, STILL_UNTIL_S = 9.92, 11.78


def flight(
    folder: Path,
    code: str = "SUCCESS",
    still: bool = False,
    deaf: bool = False,
    crash: bool = False,
    scans: Iterable[tuple[float, float]] = (),
) -> Flight:
    """Return a flight of one goal, as the recorder of a server saw it.

    Args:
        folder: where the log goes.
        code: how the goal ends.
        still: the server's process stands still for a while: what comes meanwhile is read later.
        deaf: it sends no setpoints for as long, but reads what comes.
        crash: the vehicle hits something while the server stands still.
        scans: time (s) and nearest distance (m) of what its scanner measures.
    """
    beats = np.arange(0.0, END_S + 1.0, 1.0)
    sent: list[tuple[float, tuple[int, int], Message]] = [
        (t, VEHICLE, make("HEARTBEAT", type=2, autopilot=3, custom_mode=4, system_status=4,
                          base_mode=DISARMED if crash and t > STILL_FROM_S else ARMED))
        for t in beats
    ]  # fmt: skip
    for t in np.arange(0.0, END_S + 1.0, 0.02):
        place = make("LOCAL_POSITION_NED", time_boot_ms=int(t * 1e3), x=float(t), z=-5.0, vx=1.0)
        sent.append((t, VEHICLE, place))
    for t, near_m in scans:
        nearest_cm = 1001 if near_m == math.inf else round(100.0 * near_m)
        scan = make("OBSTACLE_DISTANCE", min_distance=5, max_distance=1000,
                    distances=[nearest_cm] + [1001] * 35 + [65535] * 36)  # fmt: skip
        sent.append((t, VEHICLE, scan))
    if crash:
        said = make("STATUSTEXT", severity=mavlink.MAV_SEVERITY_CRITICAL, text=CRASH)
        sent.append((11.0, VEHICLE, said))
    for t in np.arange(NAVIGATING_S, END_S, 0.05):
        if not (still or deaf) or not STILL_FROM_S < t < STILL_UNTIL_S:
            target = make("SET_POSITION_TARGET_LOCAL_NED", target_system=1, coordinate_frame=1,
                          type_mask=0b111111000, x=float(t), z=-5.0)  # fmt: skip
            if not (crash and t > STILL_FROM_S):
                sent.append((t, SERVER, target))
    for t, event, what in (
        (ACCEPTED_S, "ACCEPTED", ""),
        (NAVIGATING_S, "STATUS", "NAVIGATING"),
        (END_S, "ENDED", code),
    ):
        noted = notes.event(GoalHappened(GOAL_ID, event, what, what), "Navigate")
        sent += [(t, NOTES, text) for text in notes.long_text(noted, int(t))]
    if still:
        sent = [
            (STILL_UNTIL_S if STILL_FROM_S < t < STILL_UNTIL_S else t, source, message)
            for t, source, message in sent
        ]
    path = folder / "flight.tlog"
    codec = Codec(source_system=1, source_component=1)
    writer = TlogWriter(path)
    for t, source, message in sorted(sent, key=lambda one: one[0]):
        writer.write(codec.encode(with_source(message, *source)), 1_700_000_000.0 + t)
    writer.close()
    (only,) = read_flights(read_contents(path))
    return only


def about(kind: str, flown: Flight) -> list[Warned]:
    return [warned for warned in warnings(flown) if warned.first.kind == kind]


def test_a_flight_without_gaps_has_no_such_warning(tmp_path: Path) -> None:
    flown = flight(tmp_path)
    assert about("late loop", flown) == about("setpoints", flown) == []


def test_a_late_server_loop_is_named(tmp_path: Path) -> None:
    (late,) = about("late loop", flight(tmp_path, still=True))
    assert late.first.severity is EventSeverity.BAD
    assert "no setpoint for 1.9 s" in late.first.text
    assert late.times_s == (pytest.approx(STILL_FROM_S, abs=0.1),)


def test_a_setpoint_gap_with_a_live_link_is_distinguished(tmp_path: Path) -> None:
    flown = flight(tmp_path, deaf=True)
    assert about("late loop", flown) == []
    (gap,) = about("setpoints", flown)
    assert "no setpoint for 1.9 s" in gap.first.text


def test_a_crash_is_reported_with_the_events_before_it(tmp_path: Path) -> None:
    flown = flight(tmp_path, code="DISARMED", still=True, crash=True)
    (text,) = about("text", flown)
    assert (text.first.text, text.first.severity) == (CRASH, EventSeverity.BAD)
    (goal,) = about("goal", flown)
    assert "DISARMED" in goal.first.text
    assert (
        "s before: Goal d000e038 received no setpoint for 1.9 s: the server loop" in goal.first.text
    )
    assert f"0.2 s before: {CRASH}" in goal.first.text


@pytest.mark.parametrize(
    ("clearance_m", "severity"),
    [(0.3, EventSeverity.BAD), (0.8, EventSeverity.WARNING), (1.2, None)],
)
def test_low_clearance_is_a_warning(
    tmp_path: Path, clearance_m: float, severity: EventSeverity | None
) -> None:
    # Before the goal it may stand as near as its people like.
    scans = ((0.5, 0.1), (5.0, 3.0), (6.0, clearance_m), (7.0, math.inf))
    flown = flight(tmp_path, scans=scans)
    found = about("clearance", flown)
    assert [warned.first.severity for warned in found] == ([] if severity is None else [severity])
    if severity is not None:
        assert found[0].first.time_s == pytest.approx(6.0, abs=1e-3)
        assert f"{clearance_m:.2f} m from the range sensor" in found[0].first.text
