"""Recorded conversations with real autopilots, played to the simulated ones.

Intended differences stand in `comparison/differences.yaml`, each with its reason; nothing else may
differ.
"""

from __future__ import annotations

import jsonschema
import pytest

from comparison.expected_differences import document, lines, schema, stale
from comparison.motion import rms_distance_m, track
from sitl_support.recorded_flights import (
    PATHS,
    Place,
    arrival_s,
    changes,
    each,
    flight,
    flights,
    of,
    verdicts,
)

pytestmark = pytest.mark.xdist_group("recordings")  # each is played once


@pytest.mark.parametrize("name", each(*PATHS))
def test_nothing_differs_but_what_is_listed_with_its_reason(name: str) -> None:
    found = [
        f"{aspect}: {difference}"
        for verdict in verdicts(name)
        for aspect, differences in verdict.unlisted.items()
        for difference in differences
    ]
    assert found == []


@pytest.mark.parametrize("name", each(*PATHS))
def test_every_line_for_a_recording_is_still_needed(name: str) -> None:
    assert [str(line) for line in stale(name, verdicts(name))] == []


def test_every_line_names_recordings_that_are_compared() -> None:
    named = {name for line in lines() for name in line.recordings}
    assert named <= set(PATHS)
    jsonschema.Draft202012Validator.check_schema(schema())
    excluded = {name for name, entry in document()["recordings"].items() if entry.get("excluded")}
    assert set(document()["recordings"]) - excluded <= set(PATHS)


@pytest.mark.parametrize("name", each(*PATHS))
def test_there_is_something_to_compare(name: str) -> None:
    for played in flights(name):
        assert len(played.sent) > 10
        assert len(played.ours) > 100


# How close the motion is, beyond what is asked for.

CLOSE = [
    ("copter_guided", 47.0, 97.0, 0.6),
    ("copter_setpoints", 42.0, 116.0, 0.6),
    ("copter_takeoff_mix", 60.0, 92.0, 0.6),
    ("copter_acks", 74.0, 84.0, 0.6),
    ("copter_lowbatt", 42.0, 112.0, 0.6),
    ("copter_gcsloss", 42.0, 106.0, 0.6),
    ("copter_gcsloss", 63.0, 78.0, 0.3),  # the legs of RTL
    ("copter_lowbatt", 64.5, 77.0, 0.4),
    ("copter_reboot", 42.0, 65.0, 0.6),
    ("copter_auto_cleared", 42.0, 78.0, 0.9),  # of May 2025; legs of AUTO are those of 2026
    ("copter_fence", 42.0, 170.0, 0.6),
    ("rover_guided", 48.0, 103.0, 1.0),
    ("plane_guided", 26.0, 88.0, 20.0),
    ("offboard_10m_20n_gt", 10.7, 90.0, 2.0),
    ("offboard_loss_stop", 12.2, 90.0, 2.0),
    ("mavsdk_offboard_goto", 10.3, 90.0, 1.5),
    ("mission_clear", 14.0, 42.4, 1.5),
    ("mission_clear", 42.4, 140.0, 3.0),  # cleared at full speed: half a second is two metres
]
"""Recording, from, to (seconds since power-up), root mean square limit (m)"""


@pytest.mark.parametrize(
    ("name", "from_s", "to_s", "limit_m"), [pytest.param(*row, marks=of(row[0])) for row in CLOSE]
)
def test_the_path_is_close_to_the_recorded_one_all_the_time(
    name: str, from_s: float, to_s: float, limit_m: float
) -> None:
    assert rms_distance_m(flight(name), from_s, to_s) < limit_m


TARGETS: list[tuple[str, int, Place, float, float]] = [
    ("copter_guided", 1, (20.0, 0.0, -10.0), 56.25, 1.0),
    ("copter_guided", 1, (20.0, 15.0, -12.0), 65.05, 1.0),
    ("copter_setpoints", 1, (10.0, 10.0, -10.0), 64.56, 1.0),
    ("copter_setpoints", 1, (10.0, 0.0, -10.0), 104.6, 1.0),
    ("copter_lowbatt", 1, (25.0, 0.0, -10.0), 51.25, 1.0),
    ("copter_gcsloss", 1, (20.0, 0.0, -10.0), 51.26, 1.0),
    ("copter_gcsloss", 1, (0.0, 0.0, -15.0), 63.64, 1.0),
    ("rover_guided", 1, (20.0, 0.0, 0.0), 48.37, 2.5),
    ("rover_guided", 1, (20.0, 15.0, 0.0), 62.35, 2.5),
    ("multi_udp", 1, (15.0, 5.0, -8.0), 62.19, 1.5),
    ("multi_udp", 2, (15.0, 10.0, -12.0), 62.19, 1.5),
    ("multi_udp", 3, (15.0, 15.0, 0.0), 62.19, 1.5),
    ("offboard_10m_20n_gt", 1, (0.085, -0.18, -9.0), 10.7, 1.2),
    ("offboard_10m_20n_gt", 1, (20.085, -0.18, -10.0), 23.7, 1.2),
    ("offboard_loss_stop", 1, (-0.25, 0.11, -9.0), 12.2, 1.2),
    ("mavsdk_offboard_goto", 1, (-0.23, 0.11, -9.0), 10.3, 1.2),
    ("mavsdk_offboard_goto", 1, (19.77, 0.11, -10.0), 18.3, 1.2),
    ("mavsdk_offboard_goto", 1, (-10.2, 0.0, -14.0), 24.7, 2.0),
]
"""Recording, system, target (NED, m), when it was sent (s), how near counts as there (m)"""


@pytest.mark.parametrize(
    ("name", "system", "target", "from_s", "within_m"),
    [pytest.param(*row, marks=of(row[0])) for row in TARGETS],
)
def test_the_time_to_each_target_is_within_10_percent(
    name: str, system: int, target: Place, from_s: float, within_m: float
) -> None:
    played = next(f for f in flights(name) if f.recording.own[0] == system)
    real = arrival_s(played.real, target, from_s, within_m)
    assert arrival_s(played.ours, target, from_s, within_m) == pytest.approx(real, rel=0.1)


@pytest.mark.parametrize("name", each("copter_guided", "copter_reboot", "copter_gcsloss"))
def test_take_off_takes_as_long(name: str) -> None:
    played = flight(name)
    begin_s = next(t for t, m in played.sent if getattr(m, "command", 0) == 22)
    target = (0.0, 0.0, -4.8 if name == "copter_reboot" else -9.3)
    real = arrival_s(played.real, target, begin_s, 0.3)
    assert arrival_s(played.ours, target, begin_s, 0.3) == pytest.approx(real, rel=0.1)


SINGLE = [name for name in PATHS if name != "multi_udp"]


@pytest.mark.parametrize("name", each(*SINGLE))
def test_mode_and_arming_change_within_a_heartbeat_of_the_recording(name: str) -> None:
    """Except where the sky decides: the end of a landing, within 15 percent of the flight."""
    played = flight(name)
    moments = []
    for messages in (played.real, played.ours):
        found: dict[tuple[int, bool], float] = {}
        for time_s, (mode, base) in changes(messages, "HEARTBEAT", "custom_mode", "base_mode"):
            found.setdefault((mode, bool(base & 128)), time_s)
        moments.append(found)
    real, ours = moments
    begin_s = played.recording.begin_s
    for state, time_s in ours.items():
        slack_s = 1.1 if state[1] or name == "probe_ground" else 2.1
        if played.recording.autopilot == "px4" and state == list(ours)[-1]:
            slack_s += 0.15 * (real[state] - begin_s)
        assert time_s == pytest.approx(real[state], abs=slack_s), state


@pytest.mark.parametrize("name", each(*PATHS))
def test_both_tell_where_they_are(name: str) -> None:
    for played in flights(name):
        assert len(track(played.real)) > 50
        assert len(track(played.ours)) > 50
